//! tokio-modbus as the master of unit 1, on 127.0.0.1:PORT or on a serial line: `modbus PORT` or `modbus DEVICE`. Prints a line a
//! service.

use std::time::{Duration, Instant};
use tokio_modbus::client::{rtu, tcp};
use tokio_modbus::prelude::*;
use tokio_serial::SerialStream;

const CONTROLWORD: u16 = 0x0000;
const MODE: u16 = 0x0001;
const TARGET_VELOCITY: u16 = 0x0004;
const STATUSWORD: u16 = 0x0100;
const PROFILE_VELOCITY: u16 = 0x0200;
const NOTHING: u16 = 0x4000;
const BIT_RATE: u32 = 19200;
const PATIENCE: Duration = Duration::from_secs(60);

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

async fn connect(place: &str) -> Outcome<client::Context> {
    match place.parse::<u16>() {
        Ok(port) => Ok(tcp::connect_slave(([127, 0, 0, 1], port).into(), Slave(1)).await?),
        Err(_) => Ok(rtu::attach_slave(SerialStream::open(&tokio_serial::new(place, BIT_RATE))?, Slave(1))),
    }
}

async fn reach(drive: &mut client::Context, controlword: u16, state: u16) -> Outcome<()> {
    drive.write_single_register(CONTROLWORD, controlword).await??;
    let begin = Instant::now();
    while drive.read_holding_registers(STATUSWORD, 1).await??[0] & 0x6F != state {
        if begin.elapsed() > PATIENCE {
            return Err(format!("no state {state:#x}").into());
        }
    }
    Ok(())
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Outcome<()> {
    let mut drive = connect(&std::env::args().nth(1).ok_or("modbus PORT or DEVICE")?).await?;

    drive.write_multiple_registers(PROFILE_VELOCITY, &[1, 57920]).await??;
    println!("16, 3: {:?}", drive.read_holding_registers(PROFILE_VELOCITY, 2).await??);
    println!("4: {:?}", drive.read_input_registers(PROFILE_VELOCITY, 2).await??);
    drive.write_single_register(MODE, 3).await??;
    println!("6: {:?}", drive.read_holding_registers(MODE, 1).await??);
    let both = drive.read_write_multiple_registers(MODE, 1, TARGET_VELOCITY, &[0, 0]).await??;
    println!("23: {both:?}");
    println!("exception: {}", u8::from(drive.read_holding_registers(NOTHING, 1).await?.unwrap_err()));
    for (controlword, state) in [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)] {
        reach(&mut drive, controlword, state).await?;
    }
    println!("enabled");
    reach(&mut drive, 0x00, 0x40).await?;
    println!("disabled");
    Ok(())
}
