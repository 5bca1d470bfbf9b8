#!/usr/bin/env node
// A controller of three CiA 402 drives that is told one task:  node controller.js TASK.json --bus vcan0 --out FOLDER
// Exit status: 0 done; 3 stopped because of trouble on machine or bus; 2 refused. FOLDER/controller.json says why.
'use strict';

const fs = require('fs');
const path = require('path');
const { parseArgs } = require('util');

const { bringUp } = require('./bring_up');
const { Bus } = require('./bus');
const { Cycle } = require('./cycle');
const { Drive } = require('./drive');
const { stop } = require('./motion');
const { Work, taskOf } = require('./tasks');
const { Trouble } = require('./trouble');
const machine = require('./machine.json');

const STATUS = { done: 0, refused: 2, stopped: 3 };

function readOrder(file) {
    try {
        return JSON.parse(fs.readFileSync(file, 'utf8'));
    } catch (error) {
        throw new Trouble(`no task can be read: ${error.message}`);
    }
}

/** Do what a task file orders, from drives that have power to drives that are disabled. Returns how it ended. */
async function perform(taskFile, busName) {
    const order = readOrder(taskFile);
    const run = taskOf(order, machine);
    const bus = new Bus(busName);
    try {
        const drives = Object.entries(machine.axes).map(([name, axis]) => new Drive(bus, name, axis));
        for (const drive of drives)
            await bringUp(drive, order.cycle);
        const cycle = new Cycle(bus, drives, order.cycle);
        for (const signal of ['SIGINT', 'SIGTERM'])
            process.once(signal, () => { cycle.interrupted = true; });
        return await stoppedAtTheEnd(cycle, async () => run(new Work(cycle, machine, order.resume ?? false)));
    } finally {
        bus.close();
    }
}

/** Whatever comes of `work`, every axis is stopped and without voltage afterwards. */
async function stoppedAtTheEnd(cycle, work) {
    const trouble = await work().then(() => null, (error) => error);
    const moving = await stop(cycle);
    if (trouble && !(trouble instanceof Trouble))
        throw trouble;
    if (!trouble && !moving.length)
        return { outcome: 'done', reason: '', node: null, emcy: null };
    const axes = moving.length ? `NOT KNOWN TO BE STOPPED: ${moving.map(({ where }) => where)}` : 'every axis was stopped';
    const { message, node, emcy } = trouble ?? new Trouble('at the end', moving[0].node);
    return { outcome: 'stopped', reason: `${message}; ${axes}`, node, emcy };
}

/** Before the drives are up, trouble is a refusal. */
function refused(error) {
    if (!(error instanceof Trouble))
        throw error;
    return { outcome: 'refused', reason: error.message, node: error.node, emcy: error.emcy };
}

async function main() {
    const { values, positionals: [taskFile] } = parseArgs({
        allowPositionals: true, options: { bus: { type: 'string', default: 'vcan0' }, out: { type: 'string', default: '.' } },
    });
    const ending = await perform(taskFile, values.bus).catch(refused);
    fs.mkdirSync(values.out, { recursive: true });
    fs.writeFileSync(path.join(values.out, 'controller.json'), JSON.stringify({ format: 'controller/1', ...ending }, null, 2));
    if (ending.reason)
        console.error(`controller.js: ${ending.reason}`);
    process.exitCode = STATUS[ending.outcome];
}

main().catch((error) => {
    console.error(error);
    process.exitCode = 1;
});
