// A controller without a robot: is where it was commanded to be a period ago.
//   g++ -std=c++17 -O2 -Wall -Wextra stand_in.cpp -o stand_in && ./stand_in KEY_FILE PORT [WATCHDOG_S]
#include <algorithm>
#include <iostream>
#include <thread>

#include "kendama_robot.hpp"

int main(int count, char** words) {
  if (count != 3 && count != 4) return std::cerr << "stand_in KEY_FILE PORT [WATCHDOG_S]\n", 2;
  constexpr double PERIOD_S = 0.004, SPEED = 1.0, BRAKING = 20.0;  // to where a RESET wants it [rad/s]; without a command [rad/s^2]
  auto times = [&](double value) { return kendama::Joints(7, value); };
  const double watchdog_s = count == 4 ? std::stod(words[3]) : 0.25;
  kendama::Robot line(uint16_t(std::stoi(words[2])), kendama::read_key(words[1]),
                      {{"s1", "s2", "s3", "e1", "e2", "w1", "w2"}, times(-3), times(3), times(2), times(20), times(50), PERIOD_S, watchdog_s});
  kendama::Joints at = times(0), moved = times(0), speed = times(0);
  auto heard = kendama::Heard::nothing;
  double t_s = 0.0, due_s = kendama::now_s();
  std::cout << "listening" << std::endl;
  while (true) {
    due_s += PERIOD_S;
    for (double left_s; (left_s = due_s - kendama::now_s()) > 0;) {  // the newest of what comes within the period counts
      const auto now = line.poll(left_s);
      heard = now == kendama::Heard::nothing ? heard : now;
    }
    const auto was = at;
    const auto& target = line.command().position_rad;
    const bool told = heard == kendama::Heard::reset || heard == kendama::Heard::command;
    if (!line.reason().empty() || !told) {  // no command: brake within the limits
      heard = kendama::Heard::nothing, t_s += PERIOD_S;
      for (size_t i = 0; i < 7; ++i) {
        speed[i] = std::copysign(std::max(std::abs(speed[i]) - BRAKING * PERIOD_S, 0.0), speed[i]);
        at[i] += speed[i] * PERIOD_S;
      }
    } else if (heard == kendama::Heard::reset) {
      t_s = 0.0, speed = times(0);
      for (size_t i = 0; i < 7; ++i) at[i] += std::clamp(target[i] - at[i], -SPEED * PERIOD_S, SPEED * PERIOD_S);
    } else {
      at = target, speed = line.command().velocity_rad_s, t_s += PERIOD_S;
    }
    for (size_t i = 0; i < 7; ++i) moved[i] = (at[i] - was[i]) / PERIOD_S;
    if (heard == kendama::Heard::command || (heard == kendama::Heard::reset && at == target)) {
      auto sent = line.command();
      sent.effort_nm.clear();  // it adds no effort
      line.answer({t_s, sent, at, moved, times(0)});
      heard = kendama::Heard::nothing;
    }
  }
}
