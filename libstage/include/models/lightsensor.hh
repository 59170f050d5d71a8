// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelLightSensor: measures the light that falls on it. Part of <stage.hh>; C++11.
//
// Edge cases, tested in tests/models/lightsensor_test.cc:
//   light at the sensor       as at least_distance; it counts as straight ahead
//   light of the same robot   is not sensed
//   light beyond `range`      is not sensed
//   no light                  the reading is `ambient`, with noise
//   negative settings, NaN    refused in a world file; through the API they count as 0

#ifndef STAGE_MODELS_LIGHTSENSOR_HH
#define STAGE_MODELS_LIGHTSENSOR_HH

#include <atomic>
#include <vector>

#include "models/model.hh"
#include "random/random.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

/// Has one or more elements at the centre of its body, which look in different directions. The
/// reading of an element is
///
///     ambient + sum over lights of intensity / max(d, least_distance)^2 * max(0, cos a)^power
///
/// with the light's distance d in the plane and the angle a between the element's axis and the
/// direction of the light, at most half the field of view. Then noise is added, and the reading is
/// limited to 0 and the saturation. A light is in the shadow of all bodies at the sensor's height
/// that rangers see, except for those of the robots that carry the sensor and the light.
class ModelLightSensor : public Model, private internal::sensing::RaySink {
 public:
  static const int kMaxCosinePower = 100;

  ModelLightSensor(World* world, Model* parent, const std::string& type);
  ~ModelLightSensor();

  std::vector<radians_t> directions;  ///< axes of the elements, relative to the heading
  meters_t range;                     ///< lights at larger distances are not sensed
  radians_t fov;                      ///< of each element, centred on its axis
  int cosine_power;                   ///< 0: equally sensitive in the whole field of view
  bool shadows;
  meters_t least_distance;  ///< nearer lights count as lights at this distance
  double ambient;           ///< W/m2, also in each colour
  double noise;             ///< standard deviation, W/m2
  double relative_noise;    ///< standard deviation, as a fraction of the reading
  double saturation;        ///< largest reading, W/m2; may be infinite

  /// Readings of the elements, W/m2. Empty before the first update and without subscribers.
  const std::vector<double>& GetIntensities() const { return intensities_; }
  /// Red, green and blue of each element, W/m2: in the formula above, the intensity of each light
  /// is multiplied by that part of its colour, which is between 0 and 1.
  const std::vector<double>& GetColors() const { return colors_; }

  using Model::Load;
  void Load() override;
  /// Prints one line with the intensities.
  void Print(char* prefix) const override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  void Reseed(uint64_t seed) override;
  void Shutdown() override;
  /// Adds a ray to each light to the batch of the step. The readings follow when it is traced.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;
  unsigned Preparations() override;

 private:
  struct Beam {
    double x, y;  // unit vector towards the light, global
    double irradiance, red, green, blue;
    bool lit;
  };
  struct Response;
  void LoadDirections();
  void LoadSettings();
  void CollectBeams(internal::sensing::FanList* fans);
  void AddRay(uint32_t beam, double distance, const void* tree, internal::sensing::FanList* fans);
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;
  void MakeReadings();
  void Measure(size_t element, const Response& response);
  double Noisy(double reading);

  std::vector<double> intensities_, colors_;
  RandomStream random_;  // for noise; seeded at its first use
  bool seeded_;
  // The current update:
  Pose frame_;  // global pose of the elements
  std::vector<Beam> beams_;
  std::atomic<uint32_t> rays_out_;  // in the batch; several threads may deliver their hits
};

}  // namespace Stg

#endif
