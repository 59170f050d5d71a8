// SPDX-License-Identifier: GPL-2.0-or-later

#include <algorithm>
#include <cmath>

#include "messages/report.hh"
#include "stage/explain.hh"
#include "stage/format.hh"

namespace Stg::program {

namespace {

constexpr size_t kMaxKinds = 10;  // number of sensor and model kinds that are listed one by one
constexpr size_t kMaxIdleKinds = 6;
constexpr size_t kMaxHeights = 6;
constexpr size_t kMaxNames = 3;

double Seconds(usec_t time) { return static_cast<double>(time) / 1e6; }
double Number(uint64_t number) { return static_cast<double>(number); }
double Megabytes(uint64_t bytes) { return Number(bytes) / (1024.0 * 1024.0); }

std::string Joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + part;
  return text;
}

class Page {
 public:
  explicit Page(const Explanation& world) : w_(world), s_(world.scene), e_(world.estimate) {}

  std::string Print() {
    text_ += Printable(w_.file) + ": explained, not run\n";
    PrintModelled();
    PrintDoubts();
    PrintLeftOut();
    PrintStep();
    PrintMemory();
    PrintHints();
    PrintMethod();
    return std::move(text_);
  }

 private:
  void Heading(const std::string& title) { text_ += "\n" + title + "\n"; }
  void Line(const std::string& label, const std::string& text) {
    text_ += Wrapped(Format("  %-11s %s", label.c_str(), text.c_str()), 14) + "\n";
  }

  // ---- content ----

  void PrintModelled() {
    Heading("Simulated");
    Line("models", Models());
    Line("robots", Format("%zu with subscribers; %zu models have a controller", s_.robots,
                          s_.with_controller));
    PrintSensors();
    Line("bodies", Format("%zu, of %s with %zu corners", s_.bodies,
                          Count(Number(s_.blocks), "block").c_str(), s_.corners));
    Line("grid", Format("cells of %s m; %s x %s m in %zu superregions, %zu regions, %zu tiles; "
                        "%.0f cells occupied",
                        Rounded(s_.resolution).c_str(), Width(s_.extent.x).c_str(),
                        Width(s_.extent.y).c_str(), s_.superregions, s_.regions, s_.tiles,
                        Number(s_.occupied_cells)));
    Line("layers", Layers());
    if (s_.exact_sensors > 0)
      Line("outlines",
           Format("drawn twice: %zu sensors have the ray model exact", s_.exact_sensors));
    Line("steps", Format("of %s s; %s and %s in each; %s", Rounded(Seconds(s_.step)).c_str(),
                         Count(s_.updates_per_step, "update").c_str(),
                         Count(s_.callbacks_per_step, "callback").c_str(), Threads().c_str()));
    Line("in pools",
         w_.why_not_closed.empty()
             ? "closed: pools, batches and branches step it without an object per world"
             : "not closed: an object per world is needed, because " + w_.why_not_closed);
  }

  std::string Threads() const {
    const std::string count = Count(s_.threads, "thread");
    if (!s_.chooses_threads || s_.threads == 1) return count;
    return count + ", one per processor, where a step is faster with them";
  }

  static std::string Width(const Bounds& b) { return Rounded(b.max - b.min); }

  std::string Models() const {
    std::vector<std::string> parts;
    for (size_t i = 0; i < std::min(kMaxKinds, s_.types.size()); i++)
      parts.push_back(Format("%zu %s", s_.types[i].models, s_.types[i].type.c_str()));
    if (s_.types.size() > kMaxKinds)
      parts.push_back(Format("%zu other types", s_.types.size() - kMaxKinds));
    return Format("%zu: ", s_.models) + Joined(parts);
  }

  void PrintSensors() {
    size_t listed = 0, subscribed = 0;
    for (const SensorKind& kind : s_.sensors) subscribed += kind.subscribed;
    if (subscribed == 0) {
      Line("sensors", "none with subscribers");
      return;
    }
    Line("sensors", Format("%-12s %7s %9s %10s %12s %10s", "kind", "count", "rays each", "every",
                           "rays a step", "ms a step"));
    for (; listed < std::min(kMaxKinds, subscribed); listed++) PrintSensor(listed);
    if (listed == subscribed) return;
    double rays = 0, ms = 0;
    for (size_t i = listed; i < subscribed; i++) {
      rays += s_.sensors[i].RaysPerStep();
      ms += e_.kind_ms[i];
    }
    Line("", Format("%-41s %12s %10.3f", Format("%zu more kinds", subscribed - listed).c_str(),
                    Rounded(rays).c_str(), ms));
  }

  void PrintSensor(size_t i) {
    const SensorKind& kind = s_.sensors[i];
    std::string rays = Format("%.0f", Number(kind.rays));
    if (kind.rays_vary) rays = "in reach";
    if (kind.pixels > 0) rays = Format("%.0f px", Number(kind.pixels));
    const double updates = Number(kind.models) * kind.updates_per_step;
    const double each =
        w_.costs.sensors[i].sample > 0 ? w_.costs.sensors[i].rays : Number(kind.rays);
    Line("", Format("%-12s %7zu %9s %7s ms %12s %10.3f", kind.type.c_str(), kind.models,
                    rays.c_str(), Rounded(Seconds(kind.interval) * 1e3).c_str(),
                    Rounded(updates * each).c_str(), e_.kind_ms[i]));
  }

  std::string Layers() const {
    std::vector<std::string> parts;
    for (const SensedHeight& height : s_.heights) {
      if (height.sensors == 0) continue;
      if (parts.size() == std::min(kMaxHeights, s_.layer_heights)) break;
      parts.push_back(
          Format("%s m (%zu of %zu blocks)", Rounded(height.z).c_str(), height.blocks, s_.blocks));
    }
    if (parts.empty()) return "1: everything, for collisions; no ranger has subscribers";
    if (s_.layers - 1 > parts.size())
      parts.push_back(Format("%zu more", s_.layers - 1 - parts.size()));
    return Format("%zu: everything, for collisions; for rangers at ", s_.layers) + Joined(parts);
  }

  void PrintDoubts() {
    if (s_.load_warnings.empty() && RobotsUnseen().empty()) return;
    Heading("Possible mistakes");
    if (!RobotsUnseen().empty()) Line("robots", RobotsUnseen());
    for (const std::string& doubt : s_.load_warnings)
      text_ += Wrapped("  " + Printable(doubt), 4) + "\n";
  }

  /// Lists heights at which rangers see no robot at all, if the world has at least two robots.
  std::string RobotsUnseen() const {
    if (s_.robots + s_.undriven < 2) return "";
    std::vector<std::string> heights;
    for (const SensedHeight& height : s_.heights)
      if (height.sensors > 0 && height.robots == 0 && heights.size() < kMaxHeights)
        heights.push_back(Rounded(height.z) + " m");
    if (heights.empty()) return "";
    return "none has a body where rangers look, at " + Joined(heights);
  }

  // ---- left out ----

  void PrintLeftOut() {
    Heading("Not simulated, because nothing needs it");
    Line("sensors", IdleSensors());
    Line("heights", Heights());
    Line("bodies", HiddenBodies());
    Line("models",
         Format("%zu without controller; %s without subscribers", s_.models - s_.with_controller,
                Count(Number(s_.undriven), "robot").c_str()));
    Line("plane", Plane());
    Line("energy", s_.power_packs == 0
                       ? "not tracked: no power pack"
                       : Format("tracked for %zu models of %zu: %s", s_.energy_models, s_.models,
                                Count(Number(s_.power_packs), "power pack").c_str()));
    Line("the rest", Joined({s_.has_window ? "a window is open" : "no window",
                             s_.device.empty() ? "no OpenCL" : "OpenCL: " + Printable(s_.device),
                             s_.records_trails ? "trails recorded" : "no trails recorded"}));
  }

  std::string IdleSensors() const {
    std::vector<std::string> parts;
    size_t all = 0;
    for (const SensorKind& kind : s_.sensors) {
      if (kind.subscribed) continue;
      all += kind.models;
      std::string part = Format("%zu %s", kind.models, kind.type.c_str());
      if (kind.rays > 0) part += Format(" of %.0f rays", Number(kind.rays));
      part += (kind.models > 1 ? " (such as " : " (") + messages::Shortened(kind.example) + ")";
      if (parts.size() < kMaxIdleKinds) parts.push_back(part);
    }
    if (all == 0)
      return s_.sensors.empty() ? "none: there is no sensor" : "none: all are subscribed";
    return Format("%zu without subscribers: ", all) + Joined(parts);
  }

  std::string Heights() const {
    if (s_.blocks == 0) return "no bodies";
    const std::string all =
        Format("bodies reach from %s to %s m; ", Rounded(s_.body_heights.min).c_str(),
               Rounded(s_.body_heights.max).c_str());
    std::vector<std::string> idle;
    size_t idle_count = 0;
    for (const SensedHeight& height : s_.heights) {
      if (height.sensors > 0) continue;
      idle_count++;
      if (idle.size() < kMaxHeights) idle.push_back(Rounded(height.z) + " m");
    }
    const size_t used = s_.heights.size() - idle_count;
    std::string text =
        all + (used == 0 ? "no ranger has subscribers"
                         : "rangers look at " + Count(Number(used), "height") + " only");
    if (idle_count > 0)
      text +=
          Format(", not at the %zu of rangers without subscribers: ", idle_count) + Joined(idle);
    return text;
  }

  std::string HiddenBodies() const {
    const size_t unseen = s_.hidden_blocks + s_.overlooked_blocks;
    if (s_.blocks == 0) return "no bodies";
    if (unseen == 0) return "all blocks are seen by some ranger";
    std::string text = Format(
        "%zu of %zu blocks are in no ranger's layer: %zu with ranger_return < 0, %zu at other "
        "heights",
        unseen, s_.blocks, s_.hidden_blocks, s_.overlooked_blocks);
    if (s_.unseen_bodies > 0) {
      std::vector<std::string> names = s_.unseen_examples;
      names.resize(std::min(names.size(), kMaxNames));
      for (std::string& name : names) name = messages::Shortened(name);
      text += Format("; all of %s: ", Count(Number(s_.unseen_bodies), "model").c_str()) +
              Joined(names) + (s_.unseen_bodies > names.size() ? ", ..." : "");
    }
    if (s_.looking_everywhere > 0)
      text += Format(" (%s of other types look)",
                     Count(Number(s_.looking_everywhere), "sensor").c_str());
    return text;
  }

  std::string Plane() const {
    if (s_.plane_cells == 0) return "all of it: there are no bodies";
    constexpr double kTileCells = 64;
    const double made = Number(s_.tiles) * kTileCells / Number(s_.plane_cells);
    return Format(
        "%.0f %% of the extent lies in no tile: the grid takes %s MB, arrays would take "
        "%s MB",
        100 * (1 - made), Rounded(Megabytes(s_.memory.grid + s_.memory.layers)).c_str(),
        Rounded(Megabytes(s_.dense_bytes)).c_str());
  }

  // ---- cost ----

  void PrintStep() {
    Heading("Time of a step, milliseconds");
    for (const CostPart& part : e_.step)
      Line(part.name, Format("%10.3f %4.0f %%   %s", part.value, 100 * part.value / e_.step_ms,
                             part.text.c_str()));
    const double times = e_.step_ms > 0 ? Seconds(s_.step) * 1e3 / e_.step_ms : 0;
    std::string total = Format("%10.3f          ", e_.step_ms);
    if (times > 0)
      total += Format("%s x real time, r_ACC %s", Rounded(times).c_str(),
                      Rounded(std::floor(times * Number(s_.robots))).c_str());
    if (w_.steps > 0)
      total += Format("; %s: %s", Count(w_.steps, "step").c_str(),
                      Time(w_.steps * e_.step_ms / 1e3).c_str());
    Line("in all", total);
    constexpr double kNoticeable = 1.15;
    if (w_.costs.busy > kNoticeable)
      Line("now", Format("%10.3f          the machine is busy: %s x as long",
                         e_.step_ms * w_.costs.busy, Rounded(w_.costs.busy).c_str()));
    if (w_.world->speedup > 0)
      Line("pace", Format("the world's speedup holds it at %s x real time",
                          Rounded(w_.world->speedup).c_str()));
  }

  void PrintMemory() {
    Heading("Memory, MB");
    for (const CostPart& part : e_.memory)
      Line(part.name, Format("%10.2f          %s", part.value, part.text.c_str()));
    Line("peak", Format("%10.2f          %s", e_.peak_mb,
                        e_.peak_mb > e_.memory_mb ? "while loading" : "sum of these"));
  }

  void PrintHints() {
    const std::vector<std::string> hints = Hints(w_);
    if (hints.empty()) return;
    Heading("Suggestions");
    for (const std::string& hint : hints) text_ += Wrapped("  " + hint, 4) + "\n";
  }

  void PrintMethod() {
    text_ += Format(
        "\nMeasured on this machine in %s, the best of several tries: some sensors were updated\n"
        "(%s) and some robots were driven, with all bodies at their places; all state was\n"
        "restored. %s. Future behaviour of robots is unknown.\n",
        Time(w_.costs.seconds).c_str(), Count(Number(w_.costs.rays), "ray").c_str(),
        World::run_options.controllers ? "Only the controllers' Init ran"
                                       : "No controller was loaded");
  }

  const Explanation& w_;
  const SceneSummary& s_;
  const Estimate& e_;
  std::string text_;
};

}  // namespace

std::string ExplanationText(const Explanation& world) { return Page(world).Print(); }

}  // namespace Stg::program
