// The tasks that this controller can do (task/1): what is checked before anything moves, and what is done with the drives.
'use strict';

const { ready, recover, stream, travel } = require('./motion');
const { Trouble } = require('./trouble');

const MOST_RECOVERIES = 5;
const REACH = 0.3; // of a soak, to either side of the middle of the travel, as a share of it

/** The drives in their cycle, and whether to go on after trouble that can be cleared. */
class Work {
    constructor(cycle, machine, resume) {
        Object.assign(this, { cycle, machine, resume, recoveries: 0 });
    }

    /** A step with axes that are homed and stream; after trouble it is done again from where they stand. */
    async do(step) {
        for (;;) {
            try {
                await ready(this.cycle);
                return await step();
            } catch (trouble) {
                const clears = trouble instanceof Trouble && this.resume && !this.cycle.interrupted;
                if (!clears || this.recoveries++ === MOST_RECOVERIES)
                    throw trouble;
                console.error(`${trouble.message}; recovering`);
                await recover(this.cycle);
            }
        }
    }

    /** To targets and stand there. */
    go(targets, dwell) {
        return this.do(async () => {
            await travel(this.cycle, targets);
            await this.cycle.runFor(dwell);
        });
    }
}

const tasks = {
    boot: {
        run: ({ cycle }) => cycle.runFor(0.5),
    },
    enable: {
        async run({ cycle }, { hold = 1 }) {
            await stream(cycle);
            await cycle.runFor(hold);
        },
    },
    home: {
        run: (work) => work.go({}, 0.1),
    },
    move: {
        targets: ({ moves }) => moves.map(({ axis, to }) => ({ [axis]: to })),
        run: goThrough,
    },
    path: {
        targets: ({ poses }) => poses,
        run: goThrough,
    },
    soak: {
        async run(work, { seconds = 60 }) {
            const pose = (share) => Object.fromEntries(Object.entries(work.machine.axes).map(
                ([name, { travel: [low, high] }]) => [name, (low + high) / 2 + share * (high - low)]));
            await work.go(pose(-REACH), 0);
            const last = work.cycle.count + seconds / work.cycle.period;
            for (let side = REACH; work.cycle.count < last; side = -side)
                await work.go(pose(side), 0);
        },
    },
};

async function goThrough(work, parameters, targets) {
    for (let time = 0; time < (parameters.repeat ?? 1); ++time)
        for (const target of targets)
            await work.go(target, parameters.dwell ?? 0.3);
}

/** The task of a task file, checked, as a function of Work. Throws Trouble for what controller or machine cannot do. */
function taskOf({ format, task, machine: name, profile, cycle, parameters = {} }, machine) {
    if (format !== 'task/1' || !(task in tasks))
        throw new Trouble(`no task of ${Object.keys(tasks).join(', ')} (task/1): ${format} ${task}`);
    if (name !== machine.machine || profile !== machine.profile)
        throw new Trouble(`this controller is for a ${machine.machine} with ${machine.profile}, not a ${name} with ${profile}`);
    if (!(cycle >= 0.001 && Math.abs(1e3 * cycle - Math.round(1e3 * cycle)) < 1e-6))
        throw new Trouble(`a cycle is whole milliseconds (60C2h), not ${cycle} s`);
    const targets = tasks[task].targets?.(parameters) ?? [];
    for (const [axis, to] of targets.flatMap(Object.entries)) {
        const [low, high] = machine.axes[axis]?.travel ?? [];
        if (!(to >= low && to <= high))
            throw new Trouble(`${axis} cannot go to ${to}: its travel is ${low} .. ${high}`);
    }
    return (work) => tasks[task].run(work, parameters, targets);
}

module.exports = { Work, taskOf };
