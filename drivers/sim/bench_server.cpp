#include "drivers/sim/bench_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <filesystem>

#include "base/error.hpp"
#include "drivers/sim/control_line.hpp"

namespace kphi::sim {
namespace {

constexpr std::chrono::milliseconds kWakeUp{1};  // wall time
constexpr int kCatchUp = 8;                      // bench time per wake-up, in wake-ups

sockaddr_in address_of(Peer peer) noexcept {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = static_cast<in_addr_t>(peer >> 16);
  address.sin_port = static_cast<in_port_t>(peer & 0xffff);
  return address;
}

Descriptor listen_for_control(const std::string& path) {
  using boost::asio::local::stream_protocol;
  const auto refused = [&](const std::string& cause, const char* next_move) {
    return DeviceError("simulated bench " + path, "open control line", cause, next_move);
  };
  boost::asio::io_context io;
  boost::system::error_code error;
  try {
    std::error_code none;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), none);
    if (std::filesystem::is_socket(path, none)) {
      if (!stream_protocol::socket(io).connect(path, error))
        throw refused("another simulator answers there", "stop it first");
      ::unlink(path.c_str());
    }
    stream_protocol::acceptor acceptor(io, path);
    acceptor.native_non_blocking(true);
    return Descriptor(acceptor.release());
  } catch (const boost::system::system_error& failure) {
    throw refused(failure.code().message(), "set simulation.control in the bench file to a free path");
  }
}

}  // namespace

Server::Server(const ServerSettings& settings)
    : time_scale_(settings.bench.time_scale),
      addresses_(settings),
      bench_(settings.bench),
      keep_motion_(settings.bench.motor_keep == IqLine::Keep::replies),
      rdt_(listen_at(settings.host, SOCK_DGRAM, settings.rdt_port)),
      foreign_(listen_at(settings.host, SOCK_DGRAM, 0)),
      web_(listen_at(settings.host, SOCK_STREAM, settings.http_port)),
      coarse_(listen_at(settings.host, SOCK_STREAM, settings.tcp_port)),
      pty_(settings.device, settings.bench.module.baud),
      http_(std::move(web_.socket), 1,
            each_question("\r\n\r\n",
                          [this](std::string_view request) {
                            StreamReply page = in_wall_time(bench_.wire().http(request, reached_));
                            page.close = true;
                            return page;
                          })),
      tcp_(std::move(coarse_.socket), 4,
           [this](std::string& heard) { return in_wall_time(bench_.wire().tcp(heard, reached_)); }),
      control_(listen_for_control(control_path(settings.control)), 16,
               each_question(
                   "\n", [this](std::string_view line) { return StreamReply{control_answer(bench_, line) + "\n"}; })),
      present_host_(settings.host),
      last_wanted_(settings.host) {
  addresses_.rdt_port = rdt_.port;
  addresses_.http_port = web_.port;
  addresses_.tcp_port = coarse_.port;
  addresses_.device = pty_.path();
  addresses_.control = control_path(settings.control);
  if (bench_.supply() == nullptr) addresses_.supply.reset();
  if (addresses_.supply) {
    supply_.emplace(*addresses_.supply);
    if (addresses_.supply->device) addresses_.supply->device = supply_->device();
    addresses_.supply->port = supply_->port();
  }
  open_or_close_web();
}

Server::~Server() { ::unlink(addresses_.control.c_str()); }

void Server::run() {
  const SteadyClock clock(time_scale_);
  const Duration step_size = clock.stretched(kWakeUp);
  bool behind = false;
  while (true) {
    // A question that nobody asked is dear at a thousand wake-ups a second.
    enum { kStop, kRequest, kMotor, kWeb, kCoarse, kControl };
    std::array<pollfd, 6> waiting{{{stop_.descriptor(), POLLIN, 0},
                                   {rdt_.socket.number(), POLLIN, 0},
                                   {pty_.number(), POLLIN, 0},
                                   {http_.listener(), POLLIN, 0},
                                   {tcp_.listener(), POLLIN, 0},
                                   {control_.listener(), POLLIN, 0}}};
    ::poll(waiting.data(), waiting.size(), behind ? 0 : static_cast<int>(kWakeUp.count()));
    if (waiting[kStop].revents != 0) return;
    const Instant now = clock.now();
    const Instant goal = std::min(now, reached_ + kCatchUp * step_size);
    behind = goal < now;
    for (bool woken = true; reached_ < goal; woken = false) {
      reached_ = std::min(goal, reached_ + step_size);
      step(clock, woken, woken && waiting[kRequest].revents != 0);
    }
    follow_the_address();
    open_or_close_web();
    http_.serve(waiting[kWeb].revents != 0);
    tcp_.serve(waiting[kCoarse].revents != 0);
    control_.serve(waiting[kControl].revents != 0);
  }
}

void Server::open_or_close_web() {
  const bool open = !bench_.wire().http_refused(reached_) && !present_host_.empty();
  if (open != http_.listening())
    http_.listen_at(open ? listen_at(present_host_, SOCK_STREAM, web_.port).socket : Descriptor());
}

void Server::follow_the_address() {
  const std::string& moved = bench_.wire().moved_to();
  const std::string& wanted = moved.empty() ? addresses_.host : moved;
  if (wanted == last_wanted_) return;
  last_wanted_ = wanted;
  http_.listen_at(Descriptor());
  tcp_.listen_at(Descriptor());
  rdt_.socket = Descriptor();
  present_host_.clear();
  try {
    rdt_ = listen_at(wanted, SOCK_DGRAM, rdt_.port);
    tcp_.listen_at(listen_at(wanted, SOCK_STREAM, coarse_.port).socket);
    present_host_ = wanted;
  } catch (const DeviceError&) {  // not an address of this machine: the box cannot be reached
  }
}

StreamReply Server::in_wall_time(StreamReply reply) const {
  for (Duration* time : {&reply.wait, &reply.pause})
    *time = Duration(static_cast<std::int64_t>(static_cast<double>(time->count()) / time_scale_));
  return reply;
}

void Server::step(const Clock& clock, bool woken, bool requested) {
  bench_.advance(reached_);
  log_motion(reached_);
  if (requested) hear_requests();
  if (woken) hear_motor(clock.now());
  log_motion(reached_);
  send_datagrams();
  send_motor();
  if (!supply_) return;
  supply_->receive(*bench_.supply(), reached_);
  supply_->send(*bench_.supply(), reached_);
}

void Server::hear_requests() {
  std::array<std::uint8_t, 64> bytes{};
  while (true) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t count = ::recvfrom(rdt_.socket.number(), bytes.data(), bytes.size(), MSG_TRUNC,
                                     reinterpret_cast<sockaddr*>(&from), &size);
    if (count < 0) return;
    const auto length = std::min(static_cast<std::size_t>(count), bytes.size());
    const Peer peer = static_cast<Peer>(from.sin_addr.s_addr) << 16 | from.sin_port;
    bench_.wire().request(std::span(bytes).first(length), peer, reached_);
  }
}

void Server::hear_motor(Instant now) {
  std::array<std::uint8_t, 512> bytes{};
  const std::size_t count = pty_.read(bytes);
  if (count == 0) return;
  IqLine& line = bench_.motor_line();
  line.host_rate(pty_.baud());
  line.send(std::span(bytes).first(count), now);
  line.advance(reached_);
}

void Server::log_motion(Instant now) {
  if (!keep_motion_) return;
  motion_.look(bench_.motor(), bench_.plant().motor().speed, now);
  if (SupplySlave* supply = bench_.supply()) motion_.look(supply->circuit(), now);
}

void Server::send_datagrams() {
  while (bench_.wire().next_datagram(datagram_, reached_)) {
    const sockaddr_in to = address_of(datagram_.peer);
    const int socket = (datagram_.foreign ? foreign_ : rdt_).socket.number();
    if (::sendto(socket, datagram_.bytes.data(), datagram_.size, MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to),
                 sizeof to) < 0)
      ++unsent_.datagrams;
  }
}

void Server::send_motor() {
  IqLine& line = bench_.motor_line();
  if (line.plugged() != pty_.plugged()) line.plugged() ? pty_.plug() : pty_.unplug();
  IqChunk chunk;
  while (line.next_chunk(chunk, reached_)) unsent_.motor_bytes += chunk.bytes.size() - pty_.write(chunk.bytes);
}

}  // namespace kphi::sim
