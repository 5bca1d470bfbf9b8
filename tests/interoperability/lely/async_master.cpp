// A master of lely-core (AsyncMaster) on the configuration that dcfgen made of a bus.yml, as ros2_canopen starts it.
//
//   async_master SOCKET MASTER.DCF SECONDS NODE...
//
// SOCKET is that of `drivetwin emulate --bus unix:SOCKET`, whose packets are SocketCAN frames, so that no kernel with CAN is needed.
// Boots its slaves, runs for SECONDS after the last of them has booted, and says one line an event:
//   boot NODE OK | boot NODE ERROR TEXT; statuswords NODE COUNT; heartbeats NODE lost; cycle NODE 1006H; emcy NODE CODE
// Exit status 0: every slave has booted and answered.

#include <linux/can.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <lely/coapp/driver.hpp>
#include <lely/coapp/master.hpp>
#include <lely/ev/loop.hpp>
#include <lely/io2/posix/poll.hpp>
#include <lely/io2/sys/io.hpp>
#include <lely/io2/sys/timer.hpp>
#include <lely/io2/user/can.hpp>

using namespace std::chrono_literals;
using lely::canopen::AsyncMaster;
using lely::canopen::BasicDriver;
using lely::canopen::NmtState;

namespace {

constexpr uint16_t CYCLE_PERIOD = 0x1006, STATUSWORD = 0x6041;
constexpr auto PATIENCE = 60s, ANSWER_WITHIN = 2s;
constexpr std::size_t WAITING = 4096, MOST_FRAMES = 64;

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

int connect_to(const char* path) {
  const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path, sizeof(address.sun_path) - 1);
  if (socket < 0 || ::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) {
    std::perror(path);
    std::exit(2);
  }
  return socket;
}

int send_frame(const can_msg* message, int, void* socket) {
  can_frame frame{};
  frame.can_id = message->id | (message->flags & CAN_FLAG_RTR ? CAN_RTR_FLAG : 0);
  frame.can_dlc = message->len;
  std::memcpy(frame.data, message->data, message->len);
  return ::send(*static_cast<int*>(socket), &frame, sizeof(frame), MSG_NOSIGNAL) == sizeof(frame) ? 0 : -1;
}

// Hands what comes on the socket to the channel.
void read_frames(int socket, lely::io::UserCanChannel& channel) {
  can_frame frames[MOST_FRAMES];
  for (ssize_t bytes; (bytes = ::recv(socket, frames, sizeof(frames), 0)) > 0;)
    for (std::size_t place = 0; place < bytes / sizeof(can_frame); ++place) {
      can_msg message = CAN_MSG_INIT;
      message.id = frames[place].can_id & CAN_SFF_MASK;
      message.flags = frames[place].can_id & CAN_RTR_FLAG ? CAN_FLAG_RTR : 0;
      message.len = frames[place].can_dlc;
      std::memcpy(message.data, frames[place].data, message.len);
      std::error_code full;
      channel.on_read(&message, -1, full);
    }
}

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
  int socket = connect_to(argv[1]);
  lely::io::UserCanChannel channel(context, loop.get_executor(), lely::io::CanBusFlag::NONE, WAITING, 0, send_frame, &socket);
  std::thread(read_frames, socket, std::ref(channel)).detach();
  AsyncMaster master(timer, channel, argv[2], "");
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
