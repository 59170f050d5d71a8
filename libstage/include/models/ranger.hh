// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelRanger: range sensors that cast rays. Part of <stage.hh>.
//
// Edge cases, tested in tests/models/ranger_test.cc:
//   no samples             empty vectors
//   over 1 000 000 samples refused in a world file; through the API 1 000 000, with a message
//   one sample             straight ahead, whatever the field of view
//   maximum range 0        no ray is cast: all readings 0, intensity 0
//   range below a cell     a ray like any other
//   infinite range         allowed ("inf" in a world file); infinite reading if nothing is hit
//   negative or NaN range  refused in a world file; through the API it counts as 0
//   minimum range          nearer hits are reported as they are, unless the sensor is blind there
//   min > max              max is used
//   field of view 0        all samples look ahead
//   field of view > 360    rays wrap; bearings are as computed
//   negative field of view the order is reversed
//   NaN field of view      refused in a world file; through the API all samples look ahead
//   sensor out of the grid nothing is hit: readings are the maximum range
//   negative noise         refused in a world file; through the API it counts as 0
//   infinite or NaN noise  refused in a world file; through the API it counts as 0
//   noise beyond the range the reading is clamped to minimum and maximum range
//   scans that take time   the robot's motion counts, that of others does not
//   no measurement         readings below the minimum or at the maximum get no noise

#ifndef STAGE_MODELS_RANGER_HH
#define STAGE_MODELS_RANGER_HH

#include <memory>
#include <vector>

#include "grid/ray_model.hh"
#include "models/model.hh"
#include "models/range_response.hh"
#include "random/random.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

struct RangeDefects;
class ScanPath;
struct SineCosine;

class ModelRanger : public Model, private internal::sensing::RaySink {
 public:
  class Sensor {
   public:
    Pose pose;     ///< in the ranger's frame
    Size size;     ///< rays start at half its height
    Bounds range;  ///< metres
    radians_t fov;
    double angle_noise;  ///< error of a ray's heading, as a fraction of half the sample increment
    double range_noise;  ///< maximum error as a fraction of the range
    double range_noise_const;   ///< variance of a normal error, square metres
    double range_step;          ///< metres: ranges are multiples of it; 0: they are not rounded
    bool blind_near;            ///< nothing is measured nearer than range.min
    double loss;                ///< probability that a ray has no return, 0 to 1
    radians_t steepest;         ///< rays that are farther from a surface's normal have no return
    double time_increment;      ///< seconds from ray to ray, from the world file; 0: all at once
    unsigned int sample_count;  ///< up to 1 000 000
    Color color;
    RayModel ray_model;      ///< what ranges are measured to
    RangeResponse response;  ///< for `values`; from the world file

    // Data: empty before the first update, then sample_count elements each. Sample 0 is at the
    // right end of the field of view.
    std::vector<meters_t> ranges;     ///< range.max if nothing was hit
    std::vector<double> intensities;  ///< ranger_return of the model hit, or 0
    std::vector<double> bearings;     ///< radians, relative to the sensor
    std::vector<double> values;       ///< of the response at the ranges; empty without one

    Sensor();
    void Load(Worldfile* wf, int entity);
    std::string String() const;
    /// Length of the rays: range.max, or 0 if that is negative or NaN.
    meters_t Reach() const;
    /// Seconds from the first ray of a scan to the last one, which is cast at the instant of the
    /// step.
    double Duration() const;
    void ExchangeState(StateExchange& exchange);

   private:
    friend class ModelRanger;
    friend class RowBridge;
    bool HasTable(uint64_t generation) const;
    void FindTable(internal::sensing::DirectionTables* tables);
    double Increment() const;
    bool HasAngleNoise() const;
    bool IsNoisy() const;
    void Finish();
    void FinishRay();
    void Copy(const internal::sensing::DeviceRanges& given, uint32_t first);
    RangeDefects Defects() const;
    void AddErrors();
    void Resize();
    void FillValues();
    void LoadRange(Worldfile* wf, int entity);
    void LoadDefects(Worldfile* wf, int entity);
    void LoadTimeIncrement(Worldfile* wf, int entity);

    // Parameters of the current bearings and direction table.
    double table_fov_;
    unsigned int table_count_;
    uint32_t first_direction_;
    uint64_t table_generation_;
    RandomStream random_;  // for noise; seeded at its first use
    bool seeded_;
    uint32_t pending_;  // rays of a skewed scan without a result
  };

  static constexpr unsigned kMaxSamples = 1000000;

  ModelRanger(World* world, Model* parent, const std::string& type);
  ~ModelRanger();

  /// One per `sensor` section, in file order.
  const std::vector<Sensor>& GetSensors() const { return sensors_; }
  std::vector<Sensor>& GetSensorsMutable() { return sensors_; }
  /// Returns the fan of a sensor without its directions. `frame` is from SensorFrame(), `turn` has
  /// the cosine and sine of its heading. The layer is kNoLayer if the grid has none for these rays
  /// yet.
  internal::sensing::Fan FanOf(uint32_t sensor, const Pose& frame, const SineCosine& turn) const;
  /// Tag of the fan of a single ray, if a scan takes time. The fan of a whole sensor has its index.
  uint32_t TagOfRay(uint32_t sensor, uint32_t ray) const;
  /// Frame of the sensors' poses while the ranger is at `global`.
  Pose SensorFrame(const Pose& global) const { return global + geom.pose; }
  /// Global pose of the ranger when it took its newest readings; without readings the present one.
  /// A step senses before it moves: pictures of scans use this pose, so that scans lie on what they
  /// have hit while the robot moves and turns.
  Pose GetScanPose() const { return has_scan_pose_ ? scan_pose_ : GetGlobalPose(); }
  /// Sets that pose. For code that writes readings by itself, such as a replay of a log.
  void SetScanPose(const Pose& global);
  /// Start of a sensor's rays. `turn` is the cosine and sine of the frame's heading.
  static Pose OriginOf(const Sensor& sensor, const Pose& frame, const SineCosine& turn);
  void LoadSensor(Worldfile* wf, int entity);
  /// Notes how the robot moved in this step. Called in each step for rangers whose scans take time.
  void NoteMotion();
  void Print(char* prefix) const override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  void DropReadings() override;
  void Reseed(uint64_t seed) override;
  void Startup() override;
  void Shutdown() override;
  /// Adds the sensors' rays to the batch of the step. The readings follow when it is traced.
  void Update() override;

 private:
  friend class RowBridge;
  void Gather(internal::sensing::FanList* fans) override;
  unsigned Preparations() override;
  void FinishPreparation() override;
  // Without angle noise, which is drawn per sample, the sizes of all fans are known in advance.
  internal::sensing::BatchSpace MeasureSpace(internal::sensing::FanList* fans,
                                             PendingSelfMasks* masks) override;
  bool FillSpace(internal::sensing::BatchSpace place, const internal::sensing::FanList& fans,
                 size_t first_fan, size_t count) override;
  void ExpectSweep(const Worldfile& file, int entity, const Sensor& sensor);
  size_t StepsOfSweep(const Sensor& sensor) const;
  double StepSeconds() const;
  void FollowPath();
  bool IsSkewed(const Sensor& sensor) const;
  internal::sensing::Fan FanOfRay(uint32_t index, uint32_t ray) const;
  Sensor* FindRays(uint32_t tag, uint32_t count, uint32_t* first);
  void CompleteReadings(Sensor* sensor, uint32_t tag);
  bool HasAngleNoise() const;
  void Prepare(Sensor* sensor, uint32_t index);
  void PrefetchHits(uint32_t tag) const override;
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;
  bool ReceiveRanges(uint32_t tag, const internal::sensing::DeviceRanges& ranges) override;

  std::vector<Sensor> sensors_;
  Pose scan_pose_;  // see GetScanPose()
  bool has_scan_pose_ = false;
  std::unique_ptr<ScanPath> path_;  // null if all scans are taken at once
  // Whether the robot moved during the present scan, and the ranger's pose on its robot.
  bool moves_ = false;
  Pose place_on_root_;
};

}  // namespace Stg

#endif
