// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelBlobfinder: a camera with one row of pixels that detects coloured blobs. Part of <stage.hh>.
//
// Each pixel of the row is a ray; consecutive rays that hit the same colour form a blob. The ray
// after a blob cannot begin the next one, so adjacent blobs have a gap of one pixel. Rays hit
// bodies at any height if their blob_return is set and they are not in the finder's own tree.
//
// Edge cases, tested in tests/models/blobfinder_test.cc:
//   width 0                 no blobs
//   height 0                blobs without height
//   range 0, negative, NaN  no blobs; a negative one is refused in a world file
//   field of view 0, NaN    all rays look ahead; blobs fill the height of the image
//   field of view negative  the row is reversed

#ifndef STAGE_MODELS_BLOBFINDER_HH
#define STAGE_MODELS_BLOBFINDER_HH

#include <vector>

#include "models/model.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

class ModelBlobfinder : public Model, private internal::sensing::RaySink {
 public:
  class Blob {
   public:
    Color color;
    uint32_t left, top, right, bottom;  ///< pixels; the origin is the top left corner
    meters_t range;                     ///< mean over the blob's rays

    Blob() : left(0), top(0), right(0), bottom(0), range(0) {}
    void ExchangeState(StateExchange& exchange);
  };

  explicit ModelBlobfinder(World* world, Model* parent, const std::string& type);
  ~ModelBlobfinder();

  /// Blobs of the last update, from right to left in the image.
  const std::vector<Blob>& GetBlobs() const { return blobs_; }
  std::vector<Blob>& GetBlobsMutable() { return blobs_; }

  // Colours to report; if empty, all colours are reported.
  void AddColor(Color col);
  void RemoveColor(Color col);
  void RemoveAllColors();

  using Model::Load;
  void Load() override;
  void Startup() override;
  /// Deletes the blobs.
  void Shutdown() override;
  /// Adds the row's rays to the batch of the step. The blobs follow when it is traced.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;

  void ExchangeState(StateExchange& exchange) override;

  radians_t fov;             ///< of the row; also spans the height of the image
  radians_t pan;             ///< heading of the image centre relative to the model
  meters_t range;            ///< maximum distance of blobs
  unsigned int scan_height;  ///< of the image, pixels
  unsigned int scan_width;   ///< of the image, pixels; also the number of rays

 private:
  friend class RowBridge;
  void LoadColors();
  void AddFan(internal::sensing::FanList* fans);
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;
  bool Reports(const Color& seen) const;
  void FindBlobs(const internal::sensing::RayHits& hits, double table_fov,
                 std::vector<Blob>* blobs) const;
  Blob MakeBlob(const Color& seen, double mean_range, double table_fov) const;

  std::vector<Blob> blobs_;
  std::vector<Color> colors_;
  bool rays_out_;  // rays are in the batch

  // Parameters of the current direction table.
  double table_fov_;
  unsigned int table_width_;
  uint64_t table_generation_;
  uint32_t first_direction_;
};

}  // namespace Stg

#endif
