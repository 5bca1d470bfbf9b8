// The drives on their bus: SDO, NMT, PDO, heartbeat and EMCY of CiA 301, the communication cycle, and what is watched in it.
#pragma once

#include <cmath>
#include <csignal>
#include <cstdio>
#include <functional>
#include <thread>

#include "bus.hpp"

using std::chrono::milliseconds;

constexpr milliseconds SDO_TIMEOUT{5000}, TPDO_TIMEOUT{5000};  // of the wall clock, which a loaded host lets run on alone
constexpr milliseconds AGAIN{500};     // for a drive that has missed a cycle already
constexpr int MISSED = 3;              // TPDOs in a row that are too many to miss, in lockstep
constexpr double STALL = 0.1;          // s without TPDO that are too long on the wall clock: a loaded host stalls processes
constexpr double SILENCE = 0.25;       // s without a heartbeat, of which one is due every 0.1 s
constexpr double STATE_TIMEOUT = 1.0;  // s that a change of state may take

inline volatile std::sig_atomic_t interrupted = 0;

inline std::string hex(uint32_t number, int digits) {
    char text[12];
    std::snprintf(text, sizeof text, "%0*Xh", digits, number);
    return text;
}

constexpr uint8_t byte(uint32_t value, int place) { return static_cast<uint8_t>(value >> 8 * place); }

constexpr uint32_t number(const uint8_t* data, int bytes) {
    return bytes == 0 ? 0 : number(data + 1, bytes - 1) << 8 | *data;
}

// CiA 402-2, table "State coding" of 6041h, and controlwords of "Command coding" of 6040h; FOLLOW is that of mode 7.
enum State : uint16_t { SWITCH_ON_DISABLED = 0x40, READY = 0x21, SWITCHED_ON = 0x23, ENABLED = 0x27, FAULT = 0x08 };
enum Control : uint16_t { DISABLE = 0x00, QUICK_STOP = 0x02, SHUTDOWN = 0x06, SWITCH_ON = 0x07, ENABLE = 0x0F, FOLLOW = 0x1F };

/// One drive: what is sent to it in each cycle, and what its frames have told.
struct Drive {
    explicit Drive(int node) : node(node) {}

    int node;
    uint16_t controlword = DISABLE, statusword = 0;
    int32_t setpoint = 0, position = 0;  // encoder increments
    bool booted = false, operating = false, heard = false;
    int missed = 0, emcy = 0;
    double silence = 0.0;         // s
    std::optional<Bytes> answer;  // of its SDO server

    bool in(State state) const { return (statusword & (state == SWITCH_ON_DISABLED || state == FAULT ? 0x4F : 0x6F)) == state; }
    bool off() const { return missed == 0 && (in(SWITCH_ON_DISABLED) || in(READY) || in(SWITCHED_ON) || in(FAULT)); }
    Trouble trouble(const std::string& what) const { return Trouble("node " + std::to_string(node) + " " + what, node, emcy); }
};

class Master {
public:
    Master(Bus& bus, double period, bool realtime)
        : period(period), bus_(bus), cycle_(std::lround(period * 1e6)), realtime_(realtime), next_(Clock::now()),
          most_missed_(realtime ? std::max(MISSED, static_cast<int>(STALL / period)) : MISSED) {}

    const double period;  // s
    std::vector<Drive> drives{Drive(1), Drive(2), Drive(3)};

    void nmt(uint8_t command, const Drive& drive) { bus_.send({Bus::frame(0x000, {command, byte(drive.node, 0)})}); }

    uint32_t read(Drive& drive, uint16_t index, uint8_t subindex) {
        const Bytes answer = ask(drive, {0x40, byte(index, 0), byte(index, 1), subindex, 0, 0, 0, 0});
        return number(&answer[4], 4 - (answer[0] >> 2 & 3));
    }

    /// Expedited download of 1, 2 or 4 bytes (CiA 301, 7.2.4.3.3), read back.
    void write(Drive& drive, uint16_t index, uint8_t subindex, uint32_t value, int bytes) {
        Bytes request{byte(0x23 | (4 - bytes) << 2, 0), byte(index, 0), byte(index, 1), subindex, 0, 0, 0, 0};
        for (int place = 0; place < bytes; ++place)
            request[4 + place] = byte(value, place);
        ask(drive, request);
        if (read(drive, index, subindex) != number(&request[4], bytes))
            throw drive.trouble("has another value in " + hex(index, 4) + " than was written");
    }

    /// Take frames until `done`; whether it came about in time.
    bool wait_until(const std::function<bool()>& done, Clock::duration patience) {
        const auto until = Clock::now() + patience;
        while (!done()) {
            const auto frame = bus_.receive(until);
            if (!frame)
                return false;
            take(*frame);
        }
        return true;
    }

    /// RPDO 1 to every drive, SYNC, TPDO 1 of every drive; one that has missed too many is not waited for.
    void step() {
        if (realtime_)
            std::this_thread::sleep_until(next_ = std::max(next_, Clock::now() - cycle_) + cycle_);
        std::vector<can_frame> frames;
        for (Drive& drive : drives) {
            const auto at = static_cast<uint32_t>(drive.setpoint);
            const auto word = drive.controlword;
            const Bytes output{byte(word, 0), byte(word, 1), byte(at, 0), byte(at, 1), byte(at, 2), byte(at, 3)};
            frames.push_back(Bus::frame(0x200 + drive.node, output));
            drive.heard = false;
        }
        frames.push_back(Bus::frame(0x080, {}));
        bus_.send(frames);
        const bool missing = std::any_of(drives.begin(), drives.end(), [](const Drive& drive) { return drive.missed > 0; });
        const Clock::duration patience = realtime_ ? cycle_ : missing ? AGAIN : TPDO_TIMEOUT;
        const auto settled = [this](const Drive& one) { return one.heard || one.missed >= most_missed_; };
        wait_until([this, settled] { return all(settled); }, patience);
        for (Drive& drive : drives) {
            drive.missed = drive.heard ? 0 : drive.missed + 1;
            drive.silence += period;
        }
    }

    /// A cycle, and a look at every drive. Throws Trouble for the first thing that is wrong.
    void run() {
        step();
        for (const Drive& drive : drives) {
            if (drive.emcy)
                throw drive.trouble("reports EMCY " + hex(drive.emcy, 4));
            if (drive.booted)
                throw drive.trouble("has started anew");
            if (drive.missed >= most_missed_)
                throw drive.trouble("sends no TPDO any more");
            if (drive.silence > SILENCE)
                throw drive.trouble("sends no heartbeat any more");
            if (drive.operating && !drive.in(ENABLED))
                throw drive.trouble("has left operation: 6041h is " + hex(drive.statusword, 4));
        }
        if (interrupted)
            throw Trouble("interrupted");
    }

    void run_for(double seconds) {
        for (long left = std::lround(seconds / period); left > 0; --left)
            run();
    }

    /// A controlword to every drive, each standing where it is, and the state that has to come of it.
    void command(Control word, State state) {
        for (double waited = 0.0; waited < STATE_TIMEOUT; waited += period) {
            for (Drive& drive : drives) {
                drive.controlword = word;
                drive.setpoint = drive.position;
            }
            run();
            if (all([state](const Drive& drive) { return drive.in(state); }))
                return;
        }
        for (const Drive& drive : drives)
            if (!drive.in(state))
                throw drive.trouble("does not follow controlword " + hex(word, 2) + ": 6041h is " + hex(drive.statusword, 4));
    }

    /// Every axis to rest and without voltage, whatever else is wrong; false where a drive is not known to be.
    bool stop() {
        const auto off = [](const Drive& drive) { return drive.off(); };
        for (const Control word : {QUICK_STOP, DISABLE}) {
            for (Drive& drive : drives) {
                drive.operating = false;
                drive.controlword = word;
            }
            step();  // the statuswords of before the command say nothing
            for (double waited = 0.0; waited < STATE_TIMEOUT && !all(off); waited += period)
                step();
        }
        return all(off);
    }

private:
    bool all(const std::function<bool(const Drive&)>& is) const { return std::all_of(drives.begin(), drives.end(), is); }

    Bytes ask(Drive& drive, const Bytes& request) {
        const std::string object = hex(number(&request[1], 2), 4) + ":" + hex(request[3], 2);
        drive.answer.reset();
        bus_.send({Bus::frame(0x600 + drive.node, request)});
        if (!wait_until([&drive] { return drive.answer.has_value(); }, SDO_TIMEOUT))
            throw drive.trouble("does not answer for " + object);
        if (drive.answer->front() == 0x80)
            throw drive.trouble("refuses " + object + ", abort code " + hex(number(&drive.answer->at(4), 4), 8));
        return *drive.answer;
    }

    /// A frame of the predefined connection set (CiA 301, 7.3.3).
    void take(const can_frame& frame) {
        for (Drive& drive : drives) {
            if (frame.can_id == 0x080U + drive.node)
                drive.emcy = static_cast<int>(number(frame.data, 2));
            if (frame.can_id == 0x180U + drive.node) {
                drive.statusword = static_cast<uint16_t>(number(frame.data, 2));
                drive.position = static_cast<int32_t>(number(frame.data + 2, 4));
                drive.heard = true;
            }
            if (frame.can_id == 0x580U + drive.node)
                drive.answer.emplace(frame.data, frame.data + 8);
            if (frame.can_id == 0x700U + drive.node) {
                drive.booted = drive.booted || frame.data[0] == 0;
                drive.silence = 0.0;
            }
        }
    }

    Bus& bus_;
    std::chrono::microseconds cycle_;
    bool realtime_;
    Clock::time_point next_;
    int most_missed_;
};
