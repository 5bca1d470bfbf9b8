// A drive from power-on to operational: reset, boot-up message, identity, parameters, PDO mapping, all read back; start.
'use strict';

const { Nmt } = require('./drive');
const O = require('./objects');
const { Trouble } = require('./trouble');

const BOOT_TIMEOUT = 5000; // [ms]
const INERTIA_TOLERANCE = 0.25; // a data sheet is that good, another motor is not
const INVALID = 0x80000000; // bit 31 of a PDO's COB-ID
const SYNCHRONOUS = 1; // transmission type: at each SYNC

/** Throws Trouble for a drive that is not there, is another one, or refuses a value. */
async function bringUp(drive, period) {
    const { nmt } = drive.bus.device;
    drive.answers = false;
    await boot(drive, nmt);
    await checkDevice(drive);
    for (const [object, value] of parameters(drive, period))
        await drive.write(object, value);
    await mapPdos(drive);
    nmt.startNode(drive.node);
    drive.inputs[0].value = await drive.read(O.STATUSWORD);
    drive.inputs[1].value = await drive.read(O.POSITION);
    drive.welcome();
    drive.homed = false;
    drive.answers = true;
}

async function boot(drive, nmt) {
    const booted = new Promise((resolve) => {
        setTimeout(resolve, BOOT_TIMEOUT, false).unref();
        drive.onNmt = (state) => state === Nmt.BOOT_UP && resolve(true);
    });
    nmt.resetCommunication(drive.node);
    if (!await booted)
        throw new Trouble(`${drive.where} sent no boot-up message: is it powered?`, drive.node);
    drive.onNmt = null;
}

async function checkDevice(drive) {
    if ((await drive.read(O.DEVICE_TYPE) & 0xffff) !== 402 || !(await drive.read(O.SUPPORTED_MODES) & 1 << 6))
        throw new Trouble(`${drive.where} is no servo drive with interpolated position mode (1000h, 6502h)`, drive.node);
    const inertia = await drive.read(O.MOTOR_INERTIA);
    if (Math.abs(inertia / drive.axis.motorInertia - 1) > INERTIA_TOLERANCE)
        throw new Trouble(`${drive.where} has a motor of ${inertia} kg m2: is this the machine of machine.json?`, drive.node);
}

function parameters(drive, period) {
    const { gear, speed, acceleration, homing } = drive.axis;
    const units = (value) => drive.inUnits(value);
    return [
        [O.POLARITY, 0],
        [O.GEAR_MOTOR_TURNS, gear[0]], [O.GEAR_SHAFT_TURNS, gear[1]], [O.FEED, drive.feed], [O.FEED_SHAFT_TURNS, 1],
        [O.CYCLE_PERIOD, Math.round(period * 1e6)],
        [O.INTERPOLATION_PERIOD, Math.round(period * 1e3)], [O.INTERPOLATION_EXPONENT, -3], [O.INTERPOLATION_TYPE, 2],
        [O.MOST_SPEED, units(1.2 * speed)], [O.ACCELERATION, units(acceleration)], [O.DECELERATION, units(acceleration)],
        [O.QUICK_STOP_DECELERATION, units(2 * acceleration)],
        [O.QUICK_STOP_OPTION, 2], [O.FAULT_REACTION_OPTION, 2], // on the quick-stop ramp
        [O.FOLLOWING_ERROR_LIMIT, drive.followingErrorLimit],
        [O.HEARTBEAT_TIME, 100],
        [O.BUS_TIMEOUT, 200], [O.BUS_TIMEOUT_TYPE, 1], // without SYNC for so long the drive stops by itself
        [O.HOMING_METHOD, homing.method], [O.HOMING_ACCELERATION, units(homing.acceleration)],
        [O.HOMING_SEARCH_SPEED, units(homing.searchSpeed)], [O.HOMING_EDGE_SPEED, units(homing.edgeSpeed)],
        [O.HOME_OFFSET, units(-homing.switchPosition)], // zero position = home position + home offset
    ];
}

/** RPDO 1 and TPDO 1 as bench.yaml orders them, all others switched off. */
async function mapPdos(drive) {
    for (const communication of [0x1401, 0x1402, 0x1403, 0x1801, 0x1802, 0x1803])
        await switchOff(drive, communication);
    await mapPdo(drive, 0x1400, [O.CONTROLWORD, O.SETPOINT]);
    await mapPdo(drive, 0x1800, [O.STATUSWORD, O.POSITION]);
}

/** In the order of CiA 301, 7.5.2.36: off, no entries, entries, their number, on. */
async function mapPdo(drive, communication, objects) {
    const mapping = communication + 0x200;
    const cobId = await switchOff(drive, communication);
    await drive.write(O.at(communication, 2, O.U8), SYNCHRONOUS);
    await drive.write(O.at(mapping, 0, O.U8), 0);
    for (const [entry, { index, subIndex, bits }] of objects.entries())
        await drive.write(O.at(mapping, entry + 1, O.U32), (index << 16 | subIndex << 8 | bits) >>> 0);
    await drive.write(O.at(mapping, 0, O.U8), objects.length);
    await drive.write(O.at(communication, 1, O.U32), cobId);
}

/** Returns the COB-ID with which the PDO can be switched on again. */
async function switchOff(drive, communication) {
    const object = O.at(communication, 1, O.U32);
    const cobId = await drive.read(object);
    await drive.write(object, (cobId | INVALID) >>> 0);
    return (cobId & ~INVALID) >>> 0;
}

module.exports = { bringUp };
