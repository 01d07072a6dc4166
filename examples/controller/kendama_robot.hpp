// The robot's end of kendama's line (docs/reference/protocol.md) for a controller in C++17 on POSIX: this and blake2s.hpp, nothing else.
#pragma once
#include <arpa/inet.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "blake2s.hpp"

namespace kendama {
using Joints = std::vector<double>;
enum Kind : uint16_t { HELLO = 1, CHALLENGE, OPEN, WELCOME, RESET, COMMAND, STATE, HALT, STOPPED, WORKING = 12 };
enum class Heard { nothing, reset, command, stop };  // for reset and command, answer() is due
constexpr uint16_t VERSION = 5;
constexpr double LET_GO_S = 60.0;
constexpr size_t MOST_SENDERS = 4;

inline Bytes read_key(const std::string& path) {
  std::string text;
  if (!(std::ifstream(path) >> text) || text.size() != 64) throw std::runtime_error(path + " holds no key of 64 hexadecimal digits");
  Bytes key;
  for (size_t i = 0; i < 64; i += 2) key.push_back(uint8_t(std::stoi(text.substr(i, 2), nullptr, 16)));
  return key;
}

inline double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Command { Joints position_rad, velocity_rad_s, acceleration_rad_s2, effort_nm; };
struct State {  // what was really sent to the motors, and what the sensors say; cup and ball NaN if not tracked
  double t_s;
  Command sent;
  Joints position_rad, velocity_rad_s, effort_nm, wrist_wrench = Joints(6, 0.0), cup_m = Joints(3, NAN), ball_m = Joints(3, NAN);
  bool caught = false;
};
struct Description {
  std::vector<std::string> joint_names;
  Joints lower_rad, upper_rad, velocity_rad_s, acceleration_rad_s2, effort_nm;
  double period_s, watchdog_s;
  bool realtime = true;
};

class Robot {  // one commander at a time; call poll() every period, and answer() once to what it has heard
 public:
  Robot(uint16_t port, Bytes key, Description about, const std::string& host = "127.0.0.1") : key_(std::move(key)), about_(std::move(about)) {
    sockaddr_in here{};
    here.sin_family = AF_INET, here.sin_port = htons(port);
    if (key_.size() != 32 || inet_pton(AF_INET, host.c_str(), &here.sin_addr) != 1) throw std::runtime_error("wrong key or address");
    if (line_ = socket(AF_INET, SOCK_DGRAM, 0); bind(line_, reinterpret_cast<sockaddr*>(&here), sizeof here) != 0) throw std::runtime_error("cannot listen on this port");
    draw_nonce();
  }
  ~Robot() { close(line_); }
  Robot(const Robot&) = delete;
  const std::string& reason() const { return reason_; }  // why the robot must hold; empty while it is commanded
  const Command& command() const { return command_; }

  Heard poll(double timeout_s) {  // sorts out what has come; waits no longer than that for more
    const double until_s = now_s() + timeout_s;
    for (int i = 0; i < 1000; ++i) {  // nobody keeps the controller busy by sending much
      if (moving_ && about_.realtime && now_s() - heard_s_ > about_.watchdog_s) return stop("no datagram came in time while moving"), Heard::stop;
      fd_set ready; FD_ZERO(&ready); FD_SET(line_, &ready);
      const double left_s = std::max(until_s - now_s(), 0.0);
      timeval left{time_t(left_s), suseconds_t(1e6 * std::fmod(left_s, 1.0))};
      if (select(line_ + 1, &ready, nullptr, nullptr, &left) <= 0) return Heard::nothing;
      Bytes data(4097);
      sockaddr_in sender{}; socklen_t size = sizeof sender;
      const ssize_t got = recvfrom(line_, data.data(), data.size(), 0, reinterpret_cast<sockaddr*>(&sender), &size);
      data.resize(got < 0 ? 0 : size_t(got));
      const Heard heard = take(data, sender);
      if (heard != Heard::nothing) return heard;
    }
    return Heard::nothing;
  }

  void answer(const State& state) {  // a stop has answered already
    if (!answered_.empty() || !reason_.empty()) return;
    const size_t n = about_.joint_names.size();
    Bytes out;
    put(out, state.t_s), put(out, missed_), put(out, ignored_), put(out, uint8_t(state.caught));
    for (auto* part : {&state.sent.position_rad, &state.sent.velocity_rad_s, &state.sent.acceleration_rad_s2, &state.sent.effort_nm})
      for (size_t i = 0; i < n; ++i) put(out, part->empty() ? 0.0 : (*part)[i]);
    for (auto* part : {&state.position_rad, &state.velocity_rad_s, &state.effort_nm, &state.wrist_wrench, &state.cup_m, &state.ball_m})
      for (double value : *part) put(out, value);
    for (size_t i = 0; i < n + 15; ++i) put(out, double(NAN));
    ready_ = true, say(STATE, out);
  }

  void stop(const std::string& reason) {  // latched until another session begins; answers what was not answered
    if (reason_.empty()) reason_ = reason;
    moving_ = ready_ = false;
    if (answered_.empty()) say(STOPPED, Bytes(reason_.begin(), reason_.begin() + std::min<size_t>(reason_.size(), 400)));
  }

 private:
  template <class T> static void put(Bytes& out, T value) { out.insert(out.end(), reinterpret_cast<uint8_t*>(&value), reinterpret_cast<uint8_t*>(&value + 1)); }
  template <class T> static T get(const Bytes& data, size_t at) { T value; std::memcpy(&value, &data[at], sizeof value); return value; }

  Heard take(const Bytes& data, const sockaddr_in& sender) {
    if (data.size() < 40 || std::memcmp(data.data(), "KNDM", 4) != 0 || get<uint16_t>(data, 4) != VERSION) return ++ignored_, Heard::nothing;
    const auto kind = Kind(get<uint16_t>(data, 6));
    const auto session = get<uint64_t>(data, 8), counter = get<uint64_t>(data, 16);
    const Bytes payload(data.begin() + 24, data.end() - 16), bare(data.begin(), data.end() - 16);
    Bytes key = session_key_;
    bool ours = session == session_ && !senders_.empty();
    if (kind == HELLO) key = key_, ours = payload.size() == 16;
    else if (kind == OPEN && session == get<uint64_t>(nonce_, 0)) {
      Bytes both{'k', 'e', 'n', 'd', 'a', 'm', 'a', ' ', 's', 'e', 's', 's', 'i', 'o', 'n'};
      both.insert(both.end(), payload.begin(), payload.end()), both.insert(both.end(), nonce_.begin(), nonce_.end());
      key = blake2s(key_, both, 32), ours = !held();
    }
    const bool command = kind == RESET || kind == COMMAND || kind == HALT;
    if (!ours || key.empty() || !(command || kind == HELLO || kind == OPEN)) return ++ignored_, Heard::nothing;
    const Bytes tag = blake2s(key, bare, 16);
    uint8_t differs = 0;  // compared in constant time
    for (int i = 0; i < 16; ++i) differs |= uint8_t(tag[i] ^ data[data.size() - 16 + i]);
    if (differs) return ++ignored_, Heard::nothing;
    if (kind == HELLO) {
      Bytes both = payload;
      both.insert(both.end(), nonce_.begin(), nonce_.end());
      send(key_, CHALLENGE, held() ? session_ : 0, 0, both, sender);
    } else if (kind == OPEN && session != session_) {
      session_key_ = key, session_ = session, senders_ = {sender}, counter_ = counter, last_ = kind, heard_s_ = now_s();
      reason_.clear(), moving_ = ready_ = false, missed_ = 0, draw_nonce(), welcome();
    } else if (counter == counter_) {
      add(sender);
      if (!answered_.empty()) sendto(line_, answered_.data(), answered_.size(), 0, reinterpret_cast<const sockaddr*>(&sender), sizeof sender);
      else if (last_ == RESET) send(session_key_, WORKING, session_, counter_, {}, sender);
    } else if (counter > counter_) {
      missed_ += uint32_t(counter - counter_ - 1), counter_ = counter, last_ = kind, heard_s_ = now_s(), answered_.clear(), senders_ = {sender};
      return obey(kind, payload);
    } else {
      ++ignored_;
    }
    return Heard::nothing;
  }

  Heard obey(Kind kind, const Bytes& payload) {
    const size_t n = about_.joint_names.size(), skip = kind == RESET ? 8 : 0, rows = kind == RESET ? 1 : 4;
    const bool was_stopped = !reason_.empty();
    Joints values;
    if (kind != HALT && payload.size() == skip + 8 * rows * n)
      for (size_t i = 0; i < rows * n; ++i) values.push_back(get<double>(payload, skip + 8 * i));
    bool sane = !values.empty();
    for (double value : values) sane = sane && std::isfinite(value);
    const char* wrong = sane ? "COMMAND came before RESET was answered" : "a command came that is not finite or not whole";
    if (was_stopped || !sane || (kind == COMMAND && !ready_)) return stop(kind == HALT ? "the commander sent HALT" : wrong), was_stopped ? Heard::nothing : Heard::stop;
    ready_ = moving_ = kind == COMMAND, command_ = Command{};
    Joints* parts[] = {&command_.position_rad, &command_.velocity_rad_s, &command_.acceleration_rad_s2, &command_.effort_nm};
    for (size_t row = 0; row < rows; ++row) parts[row]->assign(values.begin() + long(row * n), values.begin() + long((row + 1) * n));
    return kind == RESET ? Heard::reset : Heard::command;
  }

  void welcome() {
    Bytes out{uint8_t(about_.joint_names.size()), uint8_t(about_.realtime)};
    put(out, about_.period_s), put(out, about_.watchdog_s), put(out, 0.0);
    for (std::string name : about_.joint_names) name.resize(48, '\0'), out.insert(out.end(), name.begin(), name.end());
    for (auto* part : {&about_.lower_rad, &about_.upper_rad, &about_.velocity_rad_s, &about_.acceleration_rad_s2, &about_.effort_nm})
      for (double value : *part) put(out, value);
    say(WELCOME, out);
  }

  bool held() const { return reason_.empty() && (moving_ || now_s() - heard_s_ < LET_GO_S); }
  void draw_nonce() { nonce_.resize(16); std::ifstream("/dev/urandom", std::ios::binary).read(reinterpret_cast<char*>(nonce_.data()), 16); }
  void say(Kind kind, const Bytes& payload) {
    for (const auto& sender : senders_) answered_ = send(session_key_, kind, session_, counter_, payload, sender);
  }
  void add(const sockaddr_in& sender) {  // who hears a datagram and sends it on sooner must not be answered alone
    for (const auto& one : senders_) if (one.sin_port == sender.sin_port && one.sin_addr.s_addr == sender.sin_addr.s_addr) return;
    if (senders_.push_back(sender); senders_.size() > MOST_SENDERS) senders_.erase(senders_.begin());
  }
  Bytes send(const Bytes& key, Kind kind, uint64_t session, uint64_t counter, const Bytes& payload, const sockaddr_in& to) {
    Bytes out{'K', 'N', 'D', 'M'};
    put(out, VERSION), put(out, uint16_t(kind)), put(out, session), put(out, counter);
    out.insert(out.end(), payload.begin(), payload.end());
    const Bytes tag = blake2s(key, out, 16);
    out.insert(out.end(), tag.begin(), tag.end());
    sendto(line_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    return out;
  }

  Bytes key_, session_key_, nonce_, answered_;
  Description about_;
  Command command_;
  std::string reason_ = "no session has begun";
  std::vector<sockaddr_in> senders_;  // of the newest datagram
  Kind last_ = HALT;
  uint64_t session_ = 0, counter_ = 0;
  uint32_t missed_ = 0, ignored_ = 0;
  double heard_s_ = 0.0;
  bool moving_ = false, ready_ = false;
  int line_ = -1;
};
}  // namespace kendama
