// Runs the controller of a header from lines of numbers, and prints what it gives: see `Compiled`.
#include "controller.hpp"

#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>

namespace policy = draft_policy;

namespace {

// The field is there only for policies that observe the velocity.
template <class Sensors>
auto estimate(Sensors& sensors, const policy::Vector& velocity, int)
    -> decltype(sensors.estimated_base_lin_vel, void()) {
  sensors.estimated_base_lin_vel = velocity;
}
template <class Sensors>
void estimate(Sensors&, const policy::Vector&, long) {}

// A number that may be "nan" or "inf", which streams do not read.
double number(std::istream& line) {
  std::string word;
  line >> word;
  return std::stod(word);
}

template <class Values>
void read(std::istream& line, Values& values) {
  for (auto& one : values) one = static_cast<std::decay_t<decltype(one)>>(number(line));
}

template <class Values>
void print(const Values& values) {
  for (double one : values) std::printf(" %.17g", one);
}

void print(const policy::Output& out) {
  print(out.angle), print(out.speed), print(out.stiffness), print(out.damping);
  print(out.torque_limit);
}

}  // namespace

int main() {
  policy::Controller controller;
  policy::Output out;
  std::string text, kind;
  while (std::getline(std::cin, text)) {
    std::istringstream line(text);
    line >> kind;
    if (kind == "names") {
      for (const char* name : policy::JOINT_NAMES) std::printf(" %s", name);
    } else if (kind == "network") {
      std::array<float, policy::OBSERVATIONS> observation;
      policy::Joints action;
      read(line, observation);
      policy::network(observation, action);
      print(action);
    } else if (kind == "start") {
      controller.start(number(line));
    } else if (kind == "hold") {
      policy::Joints angle;
      const double share = number(line);
      read(line, angle);
      out = policy::Controller::hold(angle, share);
      print(out);
    } else if (kind == "gravity") {
      std::array<double, 4> q;
      read(line, q);
      print(policy::gravity(q[0], q[1], q[2], q[3]));
    } else if (kind == "step") {
      policy::Sensors sensors;
      policy::Command command;
      policy::Vector velocity;
      const double now = number(line);
      sensors.time = number(line);
      command.time = number(line);
      read(line, command.velocity), read(line, velocity), read(line, sensors.base_ang_vel);
      read(line, sensors.projected_gravity), read(line, sensors.joint_pos);
      read(line, sensors.joint_vel);
      estimate(sensors, velocity, 0);
      out = controller.step(sensors, command, now);
      print(controller.observation()), print(controller.action()), print(out);
    } else if (kind == "torque") {
      policy::Joints angle, speed;
      const double now = number(line);
      read(line, angle), read(line, speed);
      print(controller.torque(out, angle, speed, now));
    }
    std::printf("|%s\n", policy::text(controller.stop()));
    std::fflush(stdout);
  }
}
