// The bus: SocketCAN (vcan0), or the embedded one (unix:PATH), whose packets are one or more struct can_frame.
#pragma once

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

using Clock = std::chrono::steady_clock;
using Bytes = std::vector<uint8_t>;

/// What is wrong, with which node (0: with none), and its emergency error code.
struct Trouble : std::runtime_error {
    explicit Trouble(const std::string& what, int node = 0, int emcy = 0) : runtime_error(what), node(node), emcy(emcy) {}
    int node, emcy;
};

class Bus {
public:
    /// Throws Trouble where the bus cannot be joined.
    explicit Bus(const std::string& name)
        : at_once_(name.rfind("unix:", 0) == 0 ? 64 : 1), socket_(at_once_ > 1 ? local(name.substr(5)) : can(name)) {
        if (socket_ < 0)
            throw Trouble("cannot join the bus " + name + ": " + std::strerror(errno));
    }
    ~Bus() { close(socket_); }
    Bus(const Bus&) = delete;
    Bus& operator=(const Bus&) = delete;

    static can_frame frame(canid_t identifier, const Bytes& data) {
        can_frame frame{};
        frame.can_id = identifier;
        frame.can_dlc = static_cast<uint8_t>(data.size());
        std::copy(data.begin(), data.end(), frame.data);
        return frame;
    }

    /// Frames in their order: on the embedded bus in one packet, which costs both ends one system call instead of one a frame.
    void send(const std::vector<can_frame>& frames) const {
        for (size_t sent = 0; sent < frames.size(); sent += at_once_) {
            const size_t bytes = std::min(at_once_, frames.size() - sent) * sizeof(can_frame);
            if (write(socket_, &frames[sent], bytes) != static_cast<ssize_t>(bytes))
                throw Trouble(std::string("the bus takes no frame: ") + std::strerror(errno));
        }
    }

    /// The next frame, nothing when the time is over.
    std::optional<can_frame> receive(Clock::time_point until) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
        pollfd ready{socket_, POLLIN, 0};
        if (received_.empty() && poll(&ready, 1, std::max(0, static_cast<int>(left))) > 0) {
            can_frame frames[64];
            const ssize_t bytes = read(socket_, frames, sizeof frames);
            if (bytes <= 0)
                throw Trouble("the bus has gone");
            received_.insert(received_.end(), frames, frames + bytes / sizeof(can_frame));
        }
        if (received_.empty())
            return std::nullopt;
        const can_frame frame = received_.front();
        received_.pop_front();
        return frame;
    }

private:
    static int local(const std::string& path) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path.copy(address.sun_path, sizeof address.sun_path - 1);
        return joined(socket(AF_UNIX, SOCK_SEQPACKET, 0), connect, address);
    }

    static int can(const std::string& name) {
        sockaddr_can address{};
        address.can_family = AF_CAN;
        address.can_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
        return address.can_ifindex ? joined(socket(PF_CAN, SOCK_RAW, CAN_RAW), bind, address) : -1;
    }

    template <typename Join, typename Address>
    static int joined(int descriptor, Join join, const Address& address) {
        return join(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) ? -1 : descriptor;
    }

    size_t at_once_;  // frames in a packet
    int socket_;
    std::deque<can_frame> received_;
};
