// Two simulations as a robot's software runs them: each in a thread of its own at a fixed rate, and a thread that
// commands both by their angles: "loop FOLDER PERIOD_US". What each was commanded is then played again, alone.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <thread>
#include <vector>
#include "afo_sim.h"

using Clock = std::chrono::steady_clock;
constexpr int COMMANDS = 200, STEPS = 5;  // commands, and time steps from one to the next

class Simulation {
 public:
  explicit Simulation(const char *folder) {
    char error[400];
    if (!(sim = afo_open(folder, error, sizeof error))) throw std::runtime_error(error);
  }
  ~Simulation() { afo_close(sim); }
  Simulation(const Simulation &) = delete;
  Simulation &operator=(const Simulation &) = delete;

  double command(double open) {
    set("valve/dorsiflexor_inlet/coil", open);
    set("valve/dorsiflexor_outlet/coil", 1.0 - open);
    if (afo_step(sim, STEPS)) throw std::runtime_error(afo_error(sim));
    return afo_get(sim, afo_find(sim, "ankle/angle"));
  }

 private:
  void set(const char *name, double value) {
    if (afo_set(sim, afo_find(sim, name), value)) throw std::runtime_error(afo_error(sim));
  }
  afo_sim *sim;
};

struct Leg {
  std::atomic<double> angle{0.0}, open{1.0};
  std::vector<double> commanded, angles;
};

static std::atomic<int> failed{0};

static void run(const char *folder, Leg &leg, std::chrono::microseconds period) try {
  Simulation sim(folder);
  auto due = Clock::now();
  for (int k = 0; k < COMMANDS; k++) {
    leg.commanded.push_back(leg.open);
    leg.angles.push_back(sim.command(leg.commanded.back()));
    leg.angle = leg.angles.back();
    std::this_thread::sleep_until(due += period);
  }
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  failed++;
}

static bool same(const char *folder, const Leg &leg) {
  Simulation alone(folder);
  for (size_t k = 0; k < leg.commanded.size(); k++)
    if (alone.command(leg.commanded[k]) != leg.angles[k]) return false;
  return leg.angles.size() == COMMANDS;
}

int main(int count, char **words) {
  if (count != 3) return 2;
  Leg legs[2];
  std::atomic<bool> over{false};
  const std::chrono::microseconds period(std::atoi(words[2]));
  std::thread commander([&] {
    const double most[] = {0.0, -0.05};  // each is held about an angle of its own [rad]
    for (auto due = Clock::now(); !over; std::this_thread::sleep_until(due += period))
      for (int k = 0; k < 2; k++) legs[k].open = legs[k].angle < most[k] ? 1.0 : 0.0;
  });
  std::thread first(run, words[1], std::ref(legs[0]), period);
  std::thread second(run, words[1], std::ref(legs[1]), period);
  first.join(), second.join();
  over = true;
  commander.join();
  std::printf("%.17g %.17g\n", legs[0].angles.back(), legs[1].angles.back());
  return failed || !same(words[1], legs[0]) || !same(words[1], legs[1]);
}
