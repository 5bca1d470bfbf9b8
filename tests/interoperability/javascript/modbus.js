// jsmodbus as the master of unit 1, on 127.0.0.1:PORT or on a serial line: `node modbus.js PORT` or `node modbus.js DEVICE`. Prints
// a line a service; it has no function 23.
'use strict';

const fs = require('fs');
const net = require('net');
const tty = require('tty');
const { client } = require('jsmodbus');

const CONTROLWORD = 0x0000, MODE = 0x0001, STATUSWORD = 0x0100, PROFILE_VELOCITY = 0x0200, NOTHING = 0x4000;
const PATIENCE = 60000;

const isPort = /^\d+$/.test(process.argv[2]);
const socket = isPort ? new net.Socket() : serialLine(process.argv[2]);
const drive = isPort ? new client.TCP(socket, 1, PATIENCE) : new client.RTU(socket, 1, PATIENCE);

// A terminal that says 'open', as the serial ports do for which jsmodbus is made.
function serialLine(device) {
  const line = new tty.ReadStream(fs.openSync(device, fs.constants.O_RDWR | fs.constants.O_NOCTTY));
  line.setRawMode(true);
  setImmediate(() => line.emit('open'));
  return line;
}

const registers = (done) => Array.from(done.response.body.values);
const line = (name, values) => console.log(`${name}: [${values.join(' ')}]`);

async function reach(command, state) {
  await drive.writeSingleRegister(CONTROLWORD, command);
  const until = Date.now() + PATIENCE;
  while ((registers(await drive.readHoldingRegisters(STATUSWORD, 1))[0] & 0x6f) !== state) {
    if (Date.now() > until) throw new Error(`no state ${state}`);
  }
}

async function run() {
  await drive.writeMultipleRegisters(PROFILE_VELOCITY, [1, 57920]);
  line('16, 3', registers(await drive.readHoldingRegisters(PROFILE_VELOCITY, 2)));
  line('4', registers(await drive.readInputRegisters(PROFILE_VELOCITY, 2)));
  await drive.writeSingleRegister(MODE, 3);
  line('6', registers(await drive.readHoldingRegisters(MODE, 1)));
  const refused = await drive.readHoldingRegisters(NOTHING, 1).then(() => null, (error) => error);
  console.log(`exception: ${refused.response.body.code}`);
  for (const [command, state] of [[0x06, 0x21], [0x07, 0x23], [0x0f, 0x27]]) await reach(command, state);
  console.log('enabled');
  await reach(0x00, 0x40);
  console.log('disabled');
}

function whole() {
  run().catch((error) => { console.error(error); process.exitCode = 1; }).finally(() => socket.destroy());
}

socket.on(isPort ? 'connect' : 'open', whole);
if (isPort) socket.connect({ host: '127.0.0.1', port: Number(process.argv[2]) });
