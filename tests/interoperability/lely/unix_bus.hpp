// The bus of `drivetwin emulate --bus unix:SOCKET` as a channel of lely-core: its packets are SocketCAN frames, so that no kernel with
// CAN is needed.
#pragma once

#include <linux/can.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <system_error>
#include <thread>

#include <lely/io2/user/can.hpp>

namespace unix_bus {

constexpr std::size_t WAITING = 4096, MOST_FRAMES = 64;

inline int connect_to(const char* path) {
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

inline int send_frame(const can_msg* message, int, void* socket) {
  can_frame frame{};
  frame.can_id = message->id | (message->flags & CAN_FLAG_RTR ? CAN_RTR_FLAG : 0);
  frame.can_dlc = message->len;
  std::memcpy(frame.data, message->data, message->len);
  return ::send(*static_cast<int*>(socket), &frame, sizeof(frame), MSG_NOSIGNAL) == sizeof(frame) ? 0 : -1;
}

// Hands what comes on the socket to the channel.
inline void read_frames(int socket, lely::io::UserCanChannel& channel) {
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

// A channel on the socket at a path; frames come in a thread of their own, for as long as the program runs.
struct Channel {
  Channel(lely::io::ContextBase& context, ev_exec_t* executor, const char* path)
      : socket(connect_to(path)), can(context, executor, lely::io::CanBusFlag::NONE, WAITING, 0, send_frame, &socket) {
    std::thread(read_frames, socket, std::ref(can)).detach();
  }

  int socket;
  lely::io::UserCanChannel can;
};

}  // namespace unix_bus
