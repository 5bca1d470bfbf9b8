// Moving the drives: enable, home, travel, stop. Every wait is counted in cycles, none by the wall clock.
'use strict';

const { bringUp } = require('./bring_up');
const { State } = require('./drive');
const O = require('./objects');
const { Trouble } = require('./trouble');

const Control = { DISABLE: 0, QUICK_STOP: 0x02, SHUTDOWN: 0x06, SWITCH_ON: 0x07, ENABLE: 0x0f, START: 0x1f, RESET: 0x80 };
const HOMING = 6, INTERPOLATED = 7; // modes of operation
const TARGET_REACHED = 1 << 10, HOMING_ATTAINED = 1 << 12, HOMING_ERROR = 1 << 13; // of the statusword
const STATE_TIMEOUT = 1, HOMING_TIMEOUT = 60, RETURN_TIMEOUT = 10; // [s]
const REST_FOR = 0.02, REST_SPEED = 0.002; // an axis stands that was slower for so long [s] than this share of its full speed
const STAND = 0.1; // between the way into the travel and the first move [s]

/**
 * To operation enabled in a mode, each axis holding where it stands; faults of before are reset. A drive that is enabled
 * changes its mode with voltage on: an axis under gravity must not sag in between.
 */
async function enable(cycle, drives, mode) {
    for (const drive of drives) {
        drive.streaming = false;
        if (drive.operating)
            drive.controlword = Control.ENABLE;
    }
    await cycle.run();
    const disabled = drives.filter((drive) => !drive.operating);
    await command(cycle, disabled.filter(({ state }) => state === State.FAULT), Control.RESET, State.SWITCH_ON_DISABLED);
    await command(cycle, disabled, Control.DISABLE, State.SWITCH_ON_DISABLED);
    for (const drive of drives) {
        drive.setpoint = drive.position;
        await drive.write(O.MODE, mode);
    }
    await cycle.run();
    for (const drive of drives) {
        const shown = await drive.read(O.MODE_DISPLAY);
        if (shown !== mode)
            throw new Trouble(`${drive.where} was told mode ${mode} and shows ${shown}`, drive.node);
    }
    await command(cycle, disabled, Control.SHUTDOWN, State.READY);
    await command(cycle, disabled, Control.SWITCH_ON, State.SWITCHED_ON);
    await command(cycle, disabled, Control.ENABLE, State.OPERATION_ENABLED);
    for (const drive of disabled)
        drive.operating = true;
}

/** A controlword, and the state that has to come of it. */
async function command(cycle, drives, word, state) {
    for (const drive of drives) {
        drive.setpoint = drive.position; // an axis must not leap to a set-point of former times
        drive.controlword = word;
    }
    if (await cycle.runUntil(() => drives.every((drive) => drive.state === state), STATE_TIMEOUT))
        return;
    const stuck = drives.find((drive) => drive.state !== state);
    const told = `controlword ${word.toString(16)}h, and its statusword is ${stuck.statusword.toString(16)}h`;
    throw new Trouble(`${stuck.where} does not follow ${told}`, stuck.node);
}

/** Every axis follows its set-point from where it stands. */
async function stream(cycle) {
    await enable(cycle, cycle.drives, INTERPOLATED);
    for (const drive of cycle.drives) {
        drive.setpoint = drive.position;
        drive.controlword = Control.START;
        drive.follow();
    }
    await cycle.run();
}

async function home(cycle, drives) {
    for (const drive of drives)
        drive.watchesTravel = drive.homed = false;
    await enable(cycle, drives, HOMING);
    for (const drive of drives)
        drive.controlword = Control.START;
    await cycle.runFor(0.01); // until the statusword is of this homing
    const attained = (drive) => drive.statusword & HOMING_ATTAINED && drive.statusword & TARGET_REACHED;
    const failed = (drive) => drive.statusword & HOMING_ERROR;
    await cycle.runUntil(() => drives.some(failed) || drives.every(attained), HOMING_TIMEOUT);
    const without = drives.find((drive) => failed(drive) || !attained(drive));
    if (without)
        throw new Trouble(`${without.where} did not find its home: does its limit switch work?`, without.node);
    for (const drive of drives)
        drive.homed = true;
}

/** Every axis homed and streaming, within its travel. */
async function ready(cycle) {
    const strangers = cycle.drives.filter((drive) => !drive.homed);
    if (strangers.length)
        await home(cycle, strangers);
    if (cycle.drives.every((drive) => drive.streaming))
        return;
    await stream(cycle);
    const into = cycle.drives.map((drive) => {
        const [low, high] = drive.axis.travel;
        return [drive.name, Math.min(Math.max(drive.setpoint * drive.unit, low), high)];
    });
    await travel(cycle, Object.fromEntries(into));
    await cycle.runFor(STAND);
    for (const drive of cycle.drives)
        drive.watchesTravel = true;
}

/** The named axes together along a straight line in joint space [m or rad]; the others hold. */
async function travel(cycle, targets) {
    const ways = cycle.drives.filter(({ name }) => name in targets).map((drive) => {
        const start = drive.setpoint * drive.unit;
        return { drive, start, way: targets[drive.name] - start };
    });
    const rows = Math.ceil(Math.max(0, ...ways.map(shortest)) / cycle.period);
    for (let row = 1; row <= rows; ++row) {
        const u = row / rows, share = u ** 3 * (10 - 15 * u + 6 * u ** 2);
        for (const { drive, start, way } of ways)
            drive.setpoint = drive.inUnits(start + share * way);
        await cycle.run();
    }
}

/**
 * Duration [s] of the quintic from rest to rest within speed and acceleration of an axis: 15/8 and 10/sqrt(3) of the mean
 * (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, sec. 2.1.6).
 */
function shortest({ drive: { axis }, way }) {
    const distance = Math.abs(way);
    return Math.max(15 / 8 * distance / axis.speed, Math.sqrt(10 / Math.sqrt(3) * distance / axis.acceleration));
}

/** Quick-stop and no voltage, for all drives, whatever else is wrong. Returns those that are not known to be stopped. */
async function stop(cycle) {
    const step = () => cycle.step();
    for (const drive of cycle.drives) {
        drive.operating = drive.streaming = drive.watchesTravel = false;
        drive.controlword = Control.QUICK_STOP;
    }
    await step(); // the statuswords of before the command say nothing
    await cycle.runUntil(() => cycle.drives.every((drive) => drive.withoutVoltage || !drive.answers), STATE_TIMEOUT, step);
    for (const drive of cycle.drives)
        drive.controlword = Control.DISABLE;
    await step();
    await step(); // and its statusword
    const moving = await movingStill(cycle);
    return cycle.drives.filter((drive) => !drive.answers || !drive.withoutVoltage || moving.includes(drive));
}

/** Axes that are seen and do not come to rest in time: one without voltage may be taken along by one that brakes. */
async function movingStill(cycle) {
    const seen = cycle.drives.filter(({ answers }) => answers);
    let moving = seen;
    for (let left = STATE_TIMEOUT / REST_FOR; moving.length && left > 0; --left) {
        const before = seen.map(({ position }) => position);
        for (let time = 0; time < REST_FOR; time += cycle.period)
            await cycle.step();
        moving = seen.filter((drive, k) => {
            const way = Math.abs(drive.position - before[k]) * drive.unit;
            return way > REST_SPEED * drive.axis.speed * REST_FOR;
        });
    }
    return moving;
}

/** After trouble: stop, and bring up anew what was lost. Throws Trouble where a drive does not come back. */
async function recover(cycle) {
    await stop(cycle);
    const lost = cycle.drives.filter((drive) => !drive.answers);
    const back = (drive) => drive.restarted || drive.heard;
    if (!await cycle.runUntil(() => lost.every(back), RETURN_TIMEOUT, () => cycle.step())) {
        const gone = lost.find((drive) => !back(drive));
        throw new Trouble(`${gone.where} did not come back`, gone.node);
    }
    for (const drive of lost)
        await bringUp(drive, cycle.period);
    for (const drive of cycle.drives)
        drive.welcome();
}

module.exports = { ready, recover, stop, stream, travel };
