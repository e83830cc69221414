// Example: the controller at its rate, with a robot that stands still in its home pose.
//
// Copy it into a program of your own, and replace `Robot` by your sensors and drives. Read
// README.md first, and hang the robot up.
#include "controller.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace policy = draft_policy;

namespace {

double seconds() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

// Yours to write: what the robot measures, and what its drives do.
struct Robot {
  policy::Sensors read() {
    policy::Sensors sensors;
    sensors.time = seconds();
    sensors.projected_gravity = policy::gravity(1, 0, 0, 0);
    sensors.joint_pos = policy::HOME;
    return sensors;
  }
  void write(const policy::Output&, const policy::Joints& torque) {
    for (double one : torque) largest = std::max(largest, std::abs(one));
  }
  double largest = 0.0;
};

}  // namespace

int main(int count, char** words) {
  const double duration = count > 1 ? std::atof(words[1]) : 1.0;  // [s]
  const double rising = 2.0;                                      // To the home pose [s].
  const int inner = static_cast<int>(policy::CONTROL_PERIOD / policy::TIMESTEP + 0.5);
  Robot robot;
  policy::Controller controller;
  const policy::Joints first = robot.read().joint_pos;
  const double begin = seconds();
  double slowest = 0.0, due = begin;
  bool walking = false, stopped = false;
  for (double now = begin; now - begin < rising + duration; now = seconds()) {
    const policy::Sensors sensors = robot.read();
    policy::Output out;
    if (!walking && now - begin < rising) {
      out = policy::Controller::hold(first, (now - begin) / rising);
      controller.start(now);
    } else {
      walking = true;
      const policy::Command command{now, {0.0, 0.0, 0.0}};
      const double start = seconds();
      out = controller.step(sensors, command, now);
      slowest = std::max(slowest, seconds() - start);
    }
    for (int i = 0; i < inner; ++i) {  // Not needed where the drives have a controller.
      const policy::Sensors latest = robot.read();
      robot.write(out, controller.torque(out, latest.joint_pos, latest.joint_vel, seconds()));
      due += policy::TIMESTEP;
      std::this_thread::sleep_for(std::chrono::duration<double>(due - seconds()));
    }
    if (controller.stop() != policy::Stop::None && !stopped) {
      stopped = true;  // The joints stay damped until somebody has looked: the loop goes on.
      std::printf("stop: %s\n", policy::text(controller.stop()));
    }
  }
  std::printf("%zu joints at %.0f Hz for %.1f s: slowest step %.0f us, largest torque %.1f N m\n",
              policy::JOINTS, 1.0 / policy::CONTROL_PERIOD, duration, 1e6 * slowest, robot.largest);
  return stopped ? 1 : 0;
}
