// What is watched of each drive in every cycle, on the plant's clock. Each check says what is wrong; the first one counts.
'use strict';

const { Nmt, State } = require('./drive');
const { Trouble } = require('./trouble');

const MISSED = 3; // PDOs in a row that are too many to miss
const SILENCE = 0.25; // without a heartbeat, of which one is due every 0.1 s [s]
const FASTEST = 1.5; // full speeds at which a change of position is none of the axis
const OVERSHOOT = 0.02; // how far an axis may leave its travel, as time at full speed [s]
const VOLTAGE = 1 << 4; // of the statusword

const CHECKS = [
    (drive) => drive.restarted && 'has started anew: its configuration and its zero are gone',
    (drive) => drive.emergencies.length > 0 && `reports EMCY ${hex(drive.emergencies[0])}`,
    (drive) => drive.operating && drive.state !== State.OPERATION_ENABLED && 'has left operation by itself',
    (drive) => drive.operating && !(drive.statusword & VOLTAGE) && 'has no voltage on its power stage',
    (drive) => ![null, Nmt.OPERATIONAL].includes(drive.nmtState) && 'is not operational any more',
    (drive) => drive.missed >= MISSED && `sent no PDO for ${MISSED} SYNCs`,
    (drive) => drive.silence > SILENCE && 'sends no heartbeat any more',
    (drive, period) => drive.streaming && leaps(drive, period) && 'reports a position that it cannot have reached',
    (drive) => drive.streaming && drive.followingError > drive.followingErrorLimit && 'is too far off its set-point',
    (drive) => drive.watchesTravel && outside(drive) && 'has left its travel',
];

/** Throw Trouble for the first thing that is wrong with a drive after a cycle. */
function supervise(drive, period) {
    for (const check of CHECKS) {
        const wrong = check(drive, period);
        if (wrong)
            throw new Trouble(`${drive.where} ${wrong} (6041h: ${hex(drive.statusword)})`, drive.node, drive.emergencies[0]);
    }
    if (drive.heard)
        Object.assign(drive, { lastPosition: drive.position, age: 0 });
}

/** A position too far from the last sound one, `age` cycles ago. */
function leaps({ lastPosition, position, unit, axis, age, heard }, period) {
    const way = Math.abs(position - lastPosition) * unit;
    return heard && lastPosition !== null && way > FASTEST * axis.speed * period * age + unit;
}

function outside({ position, unit, axis }) {
    const [low, high] = axis.travel, margin = OVERSHOOT * axis.speed;
    return position * unit < low - margin || position * unit > high + margin;
}

function hex(number) {
    return `${number.toString(16).toUpperCase().padStart(4, '0')}h`;
}

module.exports = { supervise, MISSED };
