// A master of lely-core (AsyncMaster) on the configuration that dcfgen made of a bus.yml, as ros2_canopen starts it.
//
//   async_master SOCKET MASTER.DCF SECONDS NODE...
//
// SOCKET is that of `drivetwin emulate --bus unix:SOCKET`.
// Boots its slaves, runs for SECONDS after the last of them has booted, and says one line an event:
//   boot NODE OK | boot NODE ERROR TEXT; statuswords NODE COUNT; heartbeats NODE lost; cycle NODE 1006H; emcy NODE CODE
// Exit status 0: every slave has booted and answered.

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <lely/coapp/driver.hpp>
#include <lely/coapp/master.hpp>
#include <lely/ev/loop.hpp>
#include <lely/io2/posix/poll.hpp>
#include <lely/io2/sys/io.hpp>
#include <lely/io2/sys/timer.hpp>

#include "unix_bus.hpp"

using namespace std::chrono_literals;
using lely::canopen::AsyncMaster;
using lely::canopen::BasicDriver;
using lely::canopen::NmtState;

namespace {

constexpr uint16_t CYCLE_PERIOD = 0x1006, STATUSWORD = 0x6041;
constexpr auto PATIENCE = 60s, ANSWER_WITHIN = 2s;

class Slave : public BasicDriver {
 public:
  Slave(ev_exec_t* executor, AsyncMaster& master, uint8_t node, std::function<void()> booted)
      : BasicDriver(executor, master, node), booted_(std::move(booted)) {}

  bool has_booted = false;
  bool has_answered = false;

  void report() const { std::printf("statuswords %d %d\n", id(), statuswords_); }

 private:
  void OnBoot(NmtState, char error, const std::string& what) noexcept override {
    if (error != 0 && error != 'L') {
      std::printf("boot %d %c %s\n", id(), error, what.c_str());
      return;
    }
    std::printf("boot %d OK\n", id());
    has_booted = true;
    SubmitRead<uint32_t>(CYCLE_PERIOD, 0, [this](uint8_t, uint16_t, uint8_t, std::error_code failure, uint32_t value) {
      std::printf("cycle %d %s\n", id(), failure ? failure.message().c_str() : std::to_string(value).c_str());
      has_answered = !failure;
    });
    booted_();
  }

  void OnRpdoWrite(uint16_t index, uint8_t) noexcept override {
    if (index == STATUSWORD) ++statuswords_;
  }

  void OnHeartbeat(bool lost) noexcept override {
    if (lost) std::printf("heartbeats %d lost\n", id());
  }

  void OnEmcy(uint16_t code, uint8_t, uint8_t*) noexcept override { std::printf("emcy %d %04X\n", id(), code); }

  std::function<void()> booted_;
  int statuswords_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "async_master SOCKET MASTER.DCF SECONDS NODE...\n");
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const auto seconds = std::chrono::seconds(std::atoi(argv[3]));

  lely::io::IoGuard guard;
  lely::io::Context context;
  lely::io::Poll poll(context);
  lely::ev::Loop loop(poll.get_poll());
  lely::io::Timer timer(poll, loop.get_executor(), CLOCK_MONOTONIC);
  unix_bus::Channel channel(context, loop.get_executor(), argv[1]);
  AsyncMaster master(timer, channel.can, argv[2], "");
  master.SetTimeout(ANSWER_WITHIN);  // of an SDO transfer: 100 ms is less than a loaded host needs

  std::vector<std::unique_ptr<Slave>> slaves;
  bool all_booted = false;
  const auto stop = [&](std::error_code) { loop.stop(); };
  const auto on_booted = [&] {
    const bool now = std::all_of(slaves.begin(), slaves.end(), [](const auto& slave) { return slave->has_booted; });
    if (now && !all_booted) master.SubmitWait(seconds, stop);
    all_booted = now;
  };
  for (int place = 4; place < argc; ++place)
    slaves.push_back(std::make_unique<Slave>(loop.get_executor(), master, std::atoi(argv[place]), on_booted));
  master.SubmitWait(PATIENCE, stop);
  master.Reset();
  loop.run();

  bool well = true;
  for (const auto& slave : slaves) {
    slave->report();
    well = well && slave->has_booted && slave->has_answered;
  }
  std::fflush(stdout);
  std::_Exit(well ? 0 : 1);  // the reader may be waiting for a channel that nobody empties any more
}
