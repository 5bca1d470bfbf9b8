// The communication cycle: a set-point to every drive, SYNC, a PDO of every drive, a look at each; in lockstep with the plant.
'use strict';

const { setTimeout: delay } = require('timers/promises');
const { supervise, MISSED } = require('./supervision');
const { Trouble } = require('./trouble');

// Wait for the PDO that does not come, and for it again in the next cycle [ms]. The plant stands still meanwhile; a PDO that is
// only late, as a loaded host makes it, would be taken for the next SYNC's from then on.
const PATIENCE = 5000, AGAIN = 500;

class Cycle {
    constructor(bus, drives, period) {
        Object.assign(this, { bus, drives, period });
        this.count = 0;
        this.interrupted = false;
        for (const drive of drives)
            drive.onPdo = () => this.look();
    }

    /** One cycle. Throws Trouble for what is wrong with a drive afterwards, or when somebody wants the program to end. */
    async run() {
        await this.step();
        for (const drive of this.drives)
            supervise(drive, this.period);
        if (this.interrupted)
            throw new Trouble('interrupted');
    }

    async runFor(seconds) {
        for (let left = Math.round(seconds / this.period); left > 0; --left)
            await this.run();
    }

    /** Cycles until `done`; whether it came about in `seconds`. */
    async runUntil(done, seconds, run = () => this.run()) {
        for (let left = Math.round(seconds / this.period); left > 0; --left) {
            await run();
            if (done())
                return true;
        }
        return false;
    }

    /** One cycle, whatever comes of it; a drive that has been silent for too long is not waited for again. */
    async step() {
        for (const drive of this.drives) {
            drive.heard = false;
            drive.send();
        }
        ++this.count;
        this.bus.device.sync.write();
        await this.awaitAnswers();
        for (const drive of this.drives) {
            ++drive.age;
            drive.silence += this.period;
            drive.missed = drive.heard ? 0 : drive.missed + 1;
            if (drive.missed >= MISSED)
                drive.answers = false;
        }
    }

    /** The PDOs of all drives that answer. */
    async awaitAnswers() {
        if (!this.drives.some((drive) => drive.answers))
            return delay(1); // frames must not outrun whoever reads them
        await new Promise((resolve) => {
            const timer = setTimeout(resolve, this.drives.some(({ missed }) => missed) ? AGAIN : PATIENCE);
            this.complete = () => {
                clearTimeout(timer);
                resolve();
            };
            this.look();
        });
        this.complete = null;
    }

    look() {
        if (this.complete && this.drives.every((drive) => drive.heard || !drive.answers))
            this.complete();
    }
}

module.exports = { Cycle };
