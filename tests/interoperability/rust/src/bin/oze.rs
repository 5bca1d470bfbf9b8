//! oze-canopen as the master of one node: `oze INTERFACE NODE COMMAND ...`. Prints what came back; numbers are hexadecimal.
//!
//!   read INDEX SUB | write INDEX SUB BYTES | nmt COMMAND | sync

use std::time::Duration;

use oze_canopen::canopen::start;
use oze_canopen::error::CoError;
use oze_canopen::interface::CanOpenInterface;
use oze_canopen::proto::nmt::{NmtCommand, NmtCommandSpecifier};

const SETTLE: Duration = Duration::from_millis(300);
/// Its sockets open and send in tasks of their own, and say nothing of it.

fn number(text: &str) -> u32 {
    u32::from_str_radix(text, 16).expect("a hexadecimal number")
}

fn bytes(text: &str) -> Vec<u8> {
    (0..text.len()).step_by(2).map(|at| number(&text[at..at + 2]) as u8).collect()
}

fn hexadecimal(data: &[u8]) -> String {
    data.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn specifier(name: &str) -> NmtCommandSpecifier {
    match name {
        "start" => NmtCommandSpecifier::StartRemoteNode,
        "stop" => NmtCommandSpecifier::StopRemoteNode,
        "pre-operational" => NmtCommandSpecifier::EnterPreOperational,
        "reset-node" => NmtCommandSpecifier::ResetNode,
        "reset-communication" => NmtCommandSpecifier::ResetCommunication,
        _ => panic!("no NMT command {name}"),
    }
}

async fn obey(bus: &CanOpenInterface, node: u8, words: &[String]) -> Result<String, CoError> {
    let object = || (number(&words[1]) as u16, number(&words[2]) as u8);
    match words[0].as_str() {
        "nmt" => bus.send_nmt(NmtCommand::new(specifier(&words[1]), node)).await?,
        "sync" => bus.send_sync().await?,
        transfer => {
            let client = bus.get_sdo_client(node).expect("it has SDO clients of the nodes 2 to 127");
            let mut client = client.lock().await;
            let (index, subindex) = object();
            if transfer == "read" {
                return Ok(hexadecimal(&client.upload(index, subindex).await?));
            }
            client.download(index, subindex, &bytes(&words[3])).await?;
        }
    }
    Ok("done".into())
}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (bus, _handles) = start(words[0].clone(), None);
    tokio::time::sleep(SETTLE).await;
    match obey(&bus, number(&words[1]) as u8, &words[2..]).await {
        Ok(answer) => println!("{answer}"),
        Err(error) => println!("error: {error:?}"),
    }
    tokio::time::sleep(SETTLE).await;
    std::process::exit(0);
}
