// A controller of three ServoOne drives in C++17 that is told one task, boot or enable (task/1):
//     controller TASK.json --bus vcan0|unix:PATH --clock sync|realtime --out FOLDER
// Exit status: 0 done; 3 stopped because of trouble on machine or bus; 2 refused. FOLDER/controller.json says why.
#include <fstream>
#include <iostream>
#include <map>
#include <regex>
#include <sstream>

#include "master.hpp"

namespace {

constexpr milliseconds BOOT_TIMEOUT{5000};
constexpr double LISTEN = 0.5;            // s that the nodes are supervised in a task `boot`
constexpr uint32_t INVALID = 0x80000000;  // bit 31 of a PDO's COB-ID

struct Order {
    std::string task, machine;
    double cycle, hold;  // s
};

struct Ending {
    std::string outcome, reason;
    int status, node, emcy;
};

/// A PDO in the order of CiA 301, 7.5.2.36: off, transmission type, no entries, entries, their number, on.
void map_pdo(Master& master, Drive& drive, uint16_t communication, const std::vector<uint32_t>& entries) {
    const uint16_t mapping = communication + 0x200;
    const uint32_t cob_id = master.read(drive, communication, 1) & ~INVALID;
    master.write(drive, communication, 1, cob_id | INVALID, 4);
    if (entries.empty())
        return;
    master.write(drive, communication, 2, 1, 1);  // at each SYNC
    master.write(drive, mapping, 0, 0, 1);
    uint8_t place = 0;
    for (const uint32_t entry : entries)
        master.write(drive, mapping, ++place, entry, 4);
    master.write(drive, mapping, 0, place, 1);
    master.write(drive, communication, 1, cob_id, 4);
}

/// From power-on to operational: reset, boot-up message, identity, parameters and PDOs, each value read back; start.
void bring_up(Master& master, Drive& drive) {
    master.nmt(0x82, drive);
    if (!master.wait_until([&drive] { return drive.booted; }, BOOT_TIMEOUT))
        throw drive.trouble("sent no boot-up message: is it powered?");
    if ((master.read(drive, 0x1000, 0) & 0xFFFF) != 402 || !(master.read(drive, 0x6502, 0) & 1 << 6))
        throw drive.trouble("is no servo drive with interpolated position mode (1000h, 6502h)");
    master.write(drive, 0x1006, 0, static_cast<uint32_t>(std::lround(master.period * 1e6)), 4);
    master.write(drive, 0x60C2, 1, static_cast<uint32_t>(std::lround(master.period * 1e3)), 1);
    master.write(drive, 0x60C2, 2, 0xFD, 1);  // 10^-3 s
    master.write(drive, 0x1017, 0, 100, 2);   // heartbeat, ms
    master.write(drive, 0x280E, 0, 200, 2);   // ServoOne: an enabled drive that gets no SYNC for 200 ms ...
    master.write(drive, 0x280D, 0, 1, 2);     // ... stops by itself
    for (const uint16_t unused : {0x1401, 0x1402, 0x1403, 0x1801, 0x1802, 0x1803})
        map_pdo(master, drive, unused, {});
    map_pdo(master, drive, 0x1400, {0x60400010, 0x60C10120});  // controlword, set-point: as bench.yaml orders
    map_pdo(master, drive, 0x1800, {0x60410010, 0x60640020});  // statusword, position
    drive.statusword = static_cast<uint16_t>(master.read(drive, 0x6041, 0));
    drive.position = drive.setpoint = static_cast<int32_t>(master.read(drive, 0x6064, 0));
    master.nmt(0x01, drive);
    drive.booted = false;
    drive.emcy = 0;
    drive.silence = 0.0;
}

/// Every axis enabled where it stands, and held for a time [s].
void enable(Master& master, double hold) {
    for (Drive& drive : master.drives)
        master.write(drive, 0x6060, 0, 7, 1);  // interpolated position mode
    master.command(DISABLE, SWITCH_ON_DISABLED);
    for (Drive& drive : master.drives)
        if (master.read(drive, 0x6061, 0) != 7)
            throw drive.trouble("was told mode 7 and shows another one (6061h)");
    master.command(SHUTDOWN, READY);
    master.command(SWITCH_ON, SWITCHED_ON);
    master.command(ENABLE, ENABLED);
    for (Drive& drive : master.drives) {
        drive.operating = true;
        drive.controlword = FOLLOW;
        drive.setpoint = drive.position;
    }
    master.run_for(hold);
}

/// Do the order wholly, from drives that have power to drives that are disabled. Trouble before they are up is a refusal.
Ending perform(const Order& order, Bus& bus, bool realtime) {
    Master master(bus, order.cycle, realtime);
    for (Drive& drive : master.drives)
        bring_up(master, drive);
    Ending ending{"done", "", 0, 0, 0};
    try {
        order.task == "enable" ? enable(master, order.hold) : master.run_for(LISTEN);
    } catch (const Trouble& trouble) {
        ending = {"stopped", trouble.what(), 3, trouble.node, trouble.emcy};
    }
    try {
        if (!master.stop())
            throw Trouble("NOT EVERY AXIS IS KNOWN TO BE STOPPED");
    } catch (const Trouble& trouble) {
        ending = {"stopped", ending.reason + "; " + trouble.what(), 3, ending.node, ending.emcy};
    }
    return ending;
}

/// The value of a key that is there once: task.json is small enough to be read without a JSON library.
std::string value(const std::string& json, const std::string& key, const std::string& otherwise) {
    std::smatch found;
    const std::regex pair("\"" + key + "\"\\s*:\\s*\"?([^\",}\\s]+)");
    return std::regex_search(json, found, pair) ? found[1].str() : otherwise;
}

Order read_order(const std::string& path) {
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    const std::string json = text.str();
    if (value(json, "format", "") != "task/1")
        throw Trouble(path + " is no task/1 file");
    const Order order{value(json, "task", ""), value(json, "machine", ""), std::stod(value(json, "cycle", "0.001")),
                      std::stod(value(json, "hold", "1.0"))};
    if (order.machine != "scara" || (order.task != "boot" && order.task != "enable"))
        throw Trouble("this controller does boot and enable on a scara, not " + order.task + " on a " + order.machine);
    return order;
}

Ending control(const std::string& task_file, std::map<std::string, std::string> options) {
    try {
        const Order order = read_order(task_file);
        if (options["--bus"].rfind("can", 0) == 0)
            throw Trouble(options["--bus"] + " may be a real machine, for which this example is not meant");
        Bus bus(options["--bus"]);
        return perform(order, bus, options["--clock"] == "realtime");
    } catch (const Trouble& trouble) {
        return {"refused", trouble.what(), 2, trouble.node, trouble.emcy};
    } catch (const std::exception& error) {
        return {"refused", error.what(), 2, 0, 0};
    }
}

void write_ending(const Ending& ending, const std::string& folder) {
    const auto number = [](int value) { return value ? std::to_string(value) : std::string("null"); };
    const std::string reason = std::regex_replace(ending.reason, std::regex("([\"\\\\])"), "\\$1");
    std::ofstream(folder + "/controller.json")
        << "{\"format\": \"controller/1\", \"outcome\": \"" << ending.outcome << "\", \"reason\": \"" << reason
        << "\", \"node\": " << number(ending.node) << ", \"emcy\": " << number(ending.emcy) << "}\n";
}

}  // namespace

int main(int count, char** words) {
    std::map<std::string, std::string> options{{"--bus", "vcan0"}, {"--clock", "sync"}, {"--out", "."}};
    for (int place = 2; place + 1 < count; place += 2)
        options[words[place]] = words[place + 1];
    for (const int signal : {SIGINT, SIGTERM})
        std::signal(signal, [](int) { interrupted = 1; });
    const Ending ending = control(count > 1 ? words[1] : "", options);
    write_ending(ending, options["--out"]);
    if (!ending.reason.empty())
        std::cerr << "controller: " << ending.reason << "\n";
    return ending.status;
}
