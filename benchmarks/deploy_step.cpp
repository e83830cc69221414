// Medians of the time of a step of a deployed controller, and of its network alone [us].
#include "controller.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <vector>

namespace policy = draft_policy;

namespace {

template <class Work>
double median(Work work) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> rounds;
  for (int round = 0; round < 2001; ++round) {
    const auto start = Clock::now();
    work();
    rounds.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  std::nth_element(rounds.begin(), rounds.begin() + 1000, rounds.end());
  return rounds[1000];
}

}  // namespace

int main() {
  std::mt19937 random(0);
  std::normal_distribution<double> normal(0.0, 0.02);
  policy::Controller controller;
  policy::Sensors sensors;
  sensors.projected_gravity = policy::gravity(1, 0, 0, 0);
  double now = 0.0, sum = 0.0;
  controller.start(now);
  const double step = median([&] {
    now += policy::CONTROL_PERIOD;
    sensors.time = now;
    for (std::size_t i = 0; i < policy::JOINTS; ++i)
      sensors.joint_pos[i] = policy::HOME[i] + normal(random);
    sum += controller.step(sensors, {now, {0.5, 0.0, 0.0}}, now).angle[0];
  });
  policy::Joints action;
  const double network = median([&] {
    policy::network(controller.observation(), action);
    sum += action[0];
  });
  std::printf("%.3f %.3f\n", step, network);
  return controller.stop() == policy::Stop::None && std::isfinite(sum) ? 0 : 1;
}
