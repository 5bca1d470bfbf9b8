// A driver of lely-core (FiberDriver, on its AsyncMaster) that boots one drive as dcfgen configured it, uses one service of it, and
// says a line for each thing that comes of it.
//
//   services SOCKET MASTER.DCF NODE SERVICE
//
// SOCKET is that of `drivetwin emulate --bus unix:SOCKET`. Exit status 0: the service has come to its end.

#include <unistd.h>

#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <lely/coapp/fiber_driver.hpp>
#include <lely/coapp/lss_master.hpp>
#include <lely/coapp/master.hpp>
#include <lely/coapp/sdo_error.hpp>
#include <lely/ev/loop.hpp>
#include <lely/io2/posix/poll.hpp>
#include <lely/io2/sys/io.hpp>
#include <lely/io2/sys/timer.hpp>

#include "unix_bus.hpp"

using namespace std::chrono_literals;
using lely::canopen::AsyncMaster;
using lely::canopen::canopen_traits;
using lely::canopen::FiberDriver;
using lely::canopen::LssAddress;
using lely::canopen::LssMaster;
using lely::canopen::LssState;
using lely::canopen::NmtCommand;
using lely::canopen::NmtState;
using lely::canopen::SdoError;

namespace {

using Bytes = std::vector<uint8_t>;

constexpr auto PATIENCE = 1200s, ANSWER_WITHIN = 60s, LSS_ANSWER_WITHIN = 1s;
constexpr uint64_t CYCLE = 10'000;           // [us]
constexpr uint16_t OF_TYPE = 0x2F00;         // the object of a data type: plus the type's code (CiA 301, table 44)
constexpr uint16_t DOMAIN = OF_TYPE + 0x0F;
constexpr std::size_t LARGE = 1'100'000;
constexpr uint16_t STATE = 0x6F, OPERATION_ENABLED = 0x27, TARGET_REACHED = 0x0400, ACKNOWLEDGED = 0x1000;

Bytes counted(std::size_t length) {
  Bytes data(length);
  for (std::size_t place = 0; place < length; ++place) data[place] = static_cast<uint8_t>(place * 31 + place / 251);
  return data;
}

void tell(const char* path, uint16_t index, const Bytes& data) {
  std::printf("%04X %s ", index, path);
  for (const uint8_t byte : data) std::printf("%02x", byte);
  std::printf("\n");
}

class Drive : public FiberDriver {
 public:
  Drive(ev_exec_t* executor, AsyncMaster& master, LssMaster& lss, uint8_t node, const std::string& service,
        std::function<void(int)> end)
      : FiberDriver(executor, master, node), lss_(lss), service_(services().at(service)), end_(std::move(end)) {}

 private:
  using Service = void (Drive::*)();

  static const std::map<std::string, Service>& services() {
    static const std::map<std::string, Service> all{
        {"types", &Drive::types},       {"domain", &Drive::domain}, {"aborts", &Drive::aborts},
        {"guarding", &Drive::guarding}, {"time", &Drive::time},     {"lss", &Drive::lss},
        {"position", &Drive::position}, {"velocity", &Drive::velocity},
    };
    return all;
  }

  void OnBoot(NmtState, char error, const std::string& what) noexcept override {
    std::printf("boot %s\n", error == 0 || error == 'L' ? "OK" : what.c_str());
    if (!std::exchange(begun_, true)) Defer([this] { run(); });
    ++boots_;
  }

  void OnNodeGuarding(bool occurred) noexcept override {
    std::printf("guarding %s\n", occurred ? "lost" : "back");
    if (occurred) end_(0);
  }

  void OnEmcy(uint16_t code, uint8_t, uint8_t*) noexcept override { std::printf("emcy %04X\n", code); }

  void run() {
    try {
      (this->*service_)();
    } catch (const std::exception& failure) {
      std::printf("failed: %s\n", failure.what());
      end_(1);
    }
  }

  // Each data type that it has, written as such to its ends; then the bytes that the drive holds. Others are bytes to it.
  void types() {
    integer<int8_t>();
    integer<int16_t>();
    integer<int32_t>();
    integer<int64_t>();
    integer<uint8_t>();
    integer<uint16_t>();
    integer<uint32_t>();
    integer<uint64_t>();
    value(-1.5F);
    value(-1.5);
    value(std::string("a text of more than one segment, by lely's AsyncMaster"));
    const std::map<uint16_t, std::size_t> lengths{{0x10, 3}, {0x16, 3}, {0x12, 5}, {0x18, 5}, {0x13, 6},
                                                  {0x19, 6}, {0x14, 7}, {0x1A, 7}, {0x0C, 6}, {0x0D, 6}};
    for (const auto& [code, length] : lengths) both_ways(OF_TYPE + code, counted(length));
    end_(0);
  }

  template <class T>
  void integer() {
    value(std::numeric_limits<T>::min());
    value(std::numeric_limits<T>::max());
  }

  template <class T>
  void value(const T& one) {
    both_ways(OF_TYPE + canopen_traits<T>::index, one);
  }

  // Expedited or in segments, then by blocks; in between the object holds something else.
  template <class T>
  void both_ways(uint16_t index, const T& one) {
    const Bytes before = Wait(AsyncRead<Bytes>(index, 0));
    Wait(AsyncWrite(index, 0, T(one)));
    tell("segments", index, Wait(AsyncRead<Bytes>(index, 0)));
    Wait(AsyncWrite(index, 0, Bytes(before)));
    Wait(AsyncBlockWrite(index, 0, T(one)));
    tell("blocks", index, Wait(AsyncBlockRead<Bytes>(index, 0)));
    std::printf("%04X read %s\n", index, Wait(AsyncRead<T>(index, 0)) == one ? "as written" : "differently");
  }

  // More than a megabyte, each way by segments and by blocks.
  void domain() {
    const Bytes first = counted(LARGE), second(first.rbegin(), first.rend());
    Wait(AsyncWrite(DOMAIN, 0, Bytes(first)));
    std::printf("by blocks %d\n", Wait(AsyncBlockRead<Bytes>(DOMAIN, 0)) == first);
    Wait(AsyncBlockWrite(DOMAIN, 0, Bytes(second)));
    std::printf("by segments %d\n", Wait(AsyncRead<Bytes>(DOMAIN, 0)) == second);
    end_(0);
  }

  template <class F>
  void refused(const char* what, F&& transfer) {
    try {
      transfer();
      std::printf("%s none\n", what);
    } catch (const SdoError& error) {
      std::printf("%s %08X\n", what, static_cast<unsigned>(error.code().value()));
    }
  }

  void aborts() {
    refused("object", [&] { Wait(AsyncRead<uint8_t>(0x7000, 0)); });
    refused("sub-index", [&] { Wait(AsyncRead<uint8_t>(0x1018, 9)); });
    refused("read-only", [&] { Wait(AsyncWrite(0x1018, 1, uint32_t{4})); });
    refused("long", [&] { Wait(AsyncWrite(0x6098, 0, uint32_t{4})); });
    refused("short", [&] { Wait(AsyncWrite(0x6081, 0, uint8_t{4})); });
    refused("high", [&] { Wait(AsyncWrite(0x6086, 0, int16_t{9})); });
    refused("value", [&] { Wait(AsyncWrite(0x6060, 0, int8_t{5})); });
    refused("read by blocks", [&] { Wait(AsyncBlockRead<uint8_t>(0x7000, 0)); });
    refused("written by blocks", [&] { Wait(AsyncBlockWrite(0x1018, 1, uint32_t{4})); });
    end_(0);
  }

  // The master asks by remote frames from now on; OnNodeGuarding ends it.
  void guarding() { std::printf("guards\n"); }

  // The drive tells nothing of a TIME; it goes on answering.
  void time() {
    master.StartTime(100ms);
    USleep(1'000'000);
    master.StopTime();
    std::printf("register %d\n", Wait(AsyncRead<uint8_t>(0x1001, 0)));
    end_(0);
  }

  // Selected by its identity, asked, left without a node-ID, found by fastscan, given one, and booted again.
  void lss() {
    const LssAddress drive(0, 0x402, 0x10000, id());
    Wait(lss_.AsyncSwitchSelective(drive));
    std::printf("node %d\n", Wait(lss_.AsyncGetId()));
    std::printf("identity %" PRIx32, Wait(lss_.AsyncGetVendorId()));
    std::printf(" %" PRIx32, Wait(lss_.AsyncGetProductCode()));
    std::printf(" %" PRIx32, Wait(lss_.AsyncGetRevision()));
    std::printf(" %" PRIx32 "\n", Wait(lss_.AsyncGetSerialNr()));
    Wait(lss_.AsyncSetBitrate(500'000));
    try {
      Wait(lss_.AsyncSetBitrate(800'001));
      std::printf("bit rate none\n");
    } catch (const std::exception&) {
      std::printf("bit rate refused\n");
    }
    Wait(lss_.AsyncSetId(0xFF));
    Wait(lss_.AsyncSwitch(LssState::WAITING));
    const int boots = boots_;
    master.Command(NmtCommand::RESET_COMM, id());
    USleep(500'000);
    std::printf("without a node-ID %d\n", Wait(lss_.AsyncIdNonConfig()));
    const LssAddress known(~0U, ~0U, ~0U, ~0xFFU);  // each other bit takes the time in which nobody answers
    const LssAddress found = Wait(lss_.AsyncFastscan(LssAddress(0, 0x402, 0x10000, 0), known));
    std::printf("found %" PRIx32 " %" PRIx32 " %" PRIx32 " %" PRIx32 "\n", found.vendor_id, found.product_code, found.revision,
                found.serial_nr);
    Wait(lss_.AsyncSetId(id()));
    Wait(lss_.AsyncSwitch(LssState::WAITING));
    while (boots_ == boots) USleep(CYCLE);
    end_(0);
  }

  uint16_t statusword() { return rpdo_mapped[0x6041][0].Read<uint16_t>(); }

  // Into the master's PDO that has the object, which is sent at once.
  template <class T>
  void send(uint16_t index, T value) {
    tpdo_mapped[index][0] = value;
    tpdo_mapped[index][0].WriteEvent();
  }

  void command(uint16_t word) { send(0x6040, word); }

  // Waits for bits of the statusword as the TPDOs tell it.
  void until(uint16_t mask, uint16_t bits) {
    while ((statusword() & mask) != bits) USleep(CYCLE);
  }

  // From 'switch on disabled' to 'operation enabled' by PDO, as ros2_canopen's driver goes.
  void enable(int8_t mode) {
    send(0x6060, mode);
    const std::pair<uint16_t, uint16_t> steps[] = {{0x00, 0x40}, {0x06, 0x21}, {0x07, 0x23}, {0x0F, OPERATION_ENABLED}};
    for (const auto& [word, state] : steps) {
      command(word);
      until(STATE, state);
      std::printf("state %02X\n", statusword() & STATE);
    }
    while (rpdo_mapped[0x6061][0].Read<int8_t>() != mode) USleep(CYCLE);
  }

  void disable() {
    command(0x00);
    until(STATE, 0x40);
    std::printf("state %02X\n", statusword() & STATE);
    end_(0);
  }

  // Two moves of profile position: speed and ramps by SDO, target and controlword by PDO.
  void position() {
    for (const uint16_t ramp : {0x6083, 0x6084}) Wait(AsyncWrite(ramp, 0, uint32_t{1} << 23));
    Wait(AsyncWrite(0x6081, 0, uint32_t{1} << 21));
    enable(1);
    for (const int32_t target : {1 << 20, -(1 << 19)}) {
      send(0x607A, target);
      command(0x1F);
      until(ACKNOWLEDGED, ACKNOWLEDGED);
      command(0x0F);
      until(ACKNOWLEDGED | TARGET_REACHED, TARGET_REACHED);
      std::printf("position %d %d\n", target, rpdo_mapped[0x6064][0].Read<int32_t>());
    }
    disable();
  }

  // Profile velocity in both directions, with ramps of a second, so that none is missed.
  void velocity() {
    for (const uint16_t ramp : {0x6083, 0x6084}) Wait(AsyncWrite(ramp, 0, uint32_t{1} << 18));
    Wait(AsyncWrite(0x606D, 0, uint16_t{10'000}));
    enable(3);
    for (const int32_t target : {1 << 18, -(1 << 18)}) {
      send(0x60FF, target);
      until(TARGET_REACHED, 0);
      until(TARGET_REACHED, TARGET_REACHED);
      std::printf("velocity %d %d\n", target, rpdo_mapped[0x606C][0].Read<int32_t>());
    }
    disable();
  }

  LssMaster& lss_;
  Service service_;
  std::function<void(int)> end_;
  bool begun_ = false;
  int boots_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "services SOCKET MASTER.DCF NODE SERVICE\n");
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  lely::io::IoGuard guard;
  lely::io::Context context;
  lely::io::Poll poll(context);
  lely::ev::Loop loop(poll.get_poll());
  lely::io::Timer timer(poll, loop.get_executor(), CLOCK_MONOTONIC);
  unix_bus::Channel channel(context, loop.get_executor(), argv[1]);
  AsyncMaster master(timer, channel.can, argv[2], "");
  master.SetTimeout(ANSWER_WITHIN);
  LssMaster lss(loop.get_executor(), master);
  lss.SetTimeout(LSS_ANSWER_WITHIN);
  int status = 1;
  const auto end = [&](int with) {
    status = with;
    loop.stop();
  };
  Drive drive(loop.get_executor(), master, lss, std::atoi(argv[3]), argv[4], end);
  master.SubmitWait(PATIENCE, [&](std::error_code) { loop.stop(); });
  master.Reset();
  loop.run();
  std::fflush(stdout);
  std::_Exit(status);  // the reader may be waiting for a channel that nobody empties any more
}
