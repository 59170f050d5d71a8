// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/device_image.hh"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <span>
#include <tuple>

#include "kernels/row_outlines.h"
#include "messages/assert.hh"
#include "messages/report.hh"
#include "motion/drive_table.hh"
#include "rows/device_columns.hh"
#include "rows/device_contacts.hh"
#include "rows/device_controls.hh"
#include "rows/device_views.hh"
#include "rows/rows.hh"

namespace Stg::rows {

namespace {

constexpr double kSecond = 1e6;  // microseconds

size_t Aligned(size_t bytes) { return (bytes + ROW_ALIGNMENT - 1) / ROW_ALIGNMENT * ROW_ALIGNMENT; }

row_planar_t RecordOf(const Pose& pose) { return {pose.x, pose.y, pose.a}; }
row_properties_t RecordOf(const MoverProperties& properties) {
  row_properties_t record;
  std::memcpy(&record, &properties, sizeof record);
  return record;
}

uint32_t Flag(bool is_set, uint32_t flag) { return is_set ? flag : 0; }

/// Fills in an image. Offsets are known once all parts before have been added.
class ImageMaker {
 public:
  ImageMaker(const std::shared_ptr<const Scene>& scene, size_t worlds, size_t contact_bytes)
      : scene_(*scene),
        worlds_(worlds),
        contact_bytes_(contact_bytes),
        start_(scene, std::array{scene->SomeSeed()}) {
    bytes_.resize(Aligned(sizeof header_));
  }

  DeviceImage Make();

 private:
  template <class T>
  uint64_t Append(std::span<const T> records) {
    const size_t offset = bytes_.size();
    bytes_.resize(Aligned(offset + records.size_bytes()));
    if (!records.empty()) std::memcpy(bytes_.data() + offset, records.data(), records.size_bytes());
    return offset;
  }
  template <class T>
  void SetPart(int part, const T& records) {
    header_.parts[part] = Append(std::span(records));
  }
  void AddNode(const Mover& mover, uint32_t node, const Pose* pose);
  void AddMovers();
  row_mover_t RecordOfMover(const Mover& mover) const;
  void AddBodies();
  void AddSensors();
  row_sensor_t RecordOfSensor(const Sensor& sensor) const;
  void AddControls();
  void AddContacts();
  void AddMaps();
  void AddViews();
  void AddStart();
  void PlaceColumns();
  void PlaceScratch();

  const Scene& scene_;
  const size_t worlds_, contact_bytes_;
  Rows start_;  // one world in its state after loading
  row_scene_t header_{};
  std::vector<std::byte> bytes_;
  std::vector<row_node_t> nodes_;
  std::vector<row_planar_t> links_;
  std::vector<uint32_t> first_node_;  // by mover
  size_t corner_count_ = 0, state_bytes_ = 0, scratch_bytes_ = 0;
};

/// Adds the frame of a node or, if `pose` is given, that pose in it.
void ImageMaker::AddNode(const Mover& mover, uint32_t node, const Pose* pose) {
  const size_t first = links_.size();
  for (uint32_t at = node; at != 0; at = mover.nodes[at].parent)
    links_.push_back(RecordOf(mover.nodes[at].local));
  std::reverse(links_.begin() + static_cast<std::ptrdiff_t>(first), links_.end());
  links_.push_back(RecordOf(mover.nodes[node].frame));
  if (pose) links_.push_back(RecordOf(*pose));
  nodes_.push_back({static_cast<uint32_t>(first), static_cast<uint32_t>(links_.size())});
}

void ImageMaker::AddMovers() {
  std::vector<row_mover_t> movers;
  for (const Mover& mover : scene_.movers) {
    movers.push_back(RecordOfMover(mover));
    first_node_.push_back(static_cast<uint32_t>(nodes_.size()));
    for (uint32_t node = 0; node < mover.nodes.size(); node++) AddNode(mover, node, nullptr);
  }
  SetPart(ROW_MOVERS, movers);
  std::vector<row_consumer_t> consumers;
  for (const Consumer& consumer : scene_.consumers)
    consumers.push_back({consumer.pack, consumer.mover, consumer.watts});
  SetPart(ROW_CONSUMERS, consumers);
}

uint32_t DriveOf(const Mover& mover) {
  if (!mover.runs) return ROW_NO_DRIVE;
  if (mover.function == motion::DriveOf(motion::kDifferential).function) return ROW_DIFFERENTIAL;
  return mover.function == motion::DriveOf(motion::kOmni).function ? ROW_OMNI : ROW_CAR;
}

row_mover_t ImageMaker::RecordOfMover(const Mover& mover) const {
  row_mover_t record{};
  record.drive = DriveOf(mover);
  record.pack = mover.pack;
  record.first_body = mover.first_body;
  record.bodies = mover.body_count;
  if (!mover.runs) return record;
  record.flags = Flag(mover.has_odometry, ROW_HAS_ODOMETRY) |
                 Flag(mover.has_noisy_odometry, ROW_HAS_NOISY_ODOMETRY) |
                 Flag(mover.obeys_velocity, ROW_OBEYS_VELOCITY) |
                 Flag(mover.drive.commands_turn, ROW_COMMANDS_TURN) |
                 Flag(mover.drive.limits_acceleration, ROW_LIMITS_ACCELERATION);
  record.properties = RecordOf(mover.properties);
  return record;
}

void ImageMaker::AddBodies() {
  std::vector<row_body_t> bodies;
  std::vector<row_point_t> corners;
  std::vector<uint32_t> rivals, groups;
  for (const Body& body : scene_.bodies) {
    row_body_t record{};
    record.mover = body.mover;
    record.node = first_node_[body.mover] + body.node;
    record.flags = Flag(body.obstacle, ROW_OBSTACLE) | Flag(body.height.min < 0, ROW_BELOW_FLOOR);
    record.first_corner = static_cast<uint32_t>(corners.size());
    record.corners = static_cast<uint32_t>(body.corners.size());
    record.first_point = body.first_point;
    record.first_byte = body.first_byte;
    record.blocked = body.blocked;
    record.first_rival = static_cast<uint32_t>(rivals.size());
    record.rivals = static_cast<uint32_t>(body.rivals.size());
    record.brightness = body.brightness;
    record.model = body.model->GetId();
    record.loading_stamp = body.loading_stamp;
    record.radius = body.radius;
    for (const point_t& corner : body.corners) corners.push_back({corner.x, corner.y});
    rivals.insert(rivals.end(), body.rivals.begin(), body.rivals.end());
    rivals.resize((rivals.size() + ROW_GROUP - 1) / ROW_GROUP * ROW_GROUP, ROW_NONE);
    groups.resize(rivals.size() / ROW_GROUP, static_cast<uint32_t>(bodies.size()));
    bodies.push_back(record);
  }
  corner_count_ = corners.size();
  SetPart(ROW_BODIES, bodies);
  SetPart(ROW_CORNERS, corners);
  SetPart(ROW_RIVALS, rivals);
  SetPart(ROW_GROUPS, groups);
  header_.groups = static_cast<uint32_t>(groups.size());
}

row_sensor_t ImageMaker::RecordOfSensor(const Sensor& sensor) const {
  const auto finite = [](double value) { return std::isfinite(value) ? value : 0.0; };
  const ModelRanger::Sensor& settings = *sensor.settings;
  row_sensor_t record{};
  record.mover = sensor.mover;
  record.flags = Flag(sensor.exact, ROW_EXACT) | Flag(sensor.noisy, ROW_NOISY) |
                 Flag(sensor.turns_noisily, ROW_TURNS_NOISILY) |
                 Flag(sensor.defects.blind_near, ROW_BLIND_NEAR);
  record.first_ray = sensor.first_ray;
  record.rays = sensor.rays;
  record.first_direction = sensor.first_direction;
  record.seen = static_cast<uint32_t>(scene_.blocked.size()) + sensor.seen;
  record.reach = sensor.reach;
  record.leg_cells = sensor.reach * scene_.cells_per_metre;
  record.increment = sensor.increment;
  record.turn_noise = sensor.increment * settings.angle_noise * 0.5;
  record.step = sensor.defects.step;
  record.loss = sensor.defects.loss;
  record.least_cosine2 = sensor.defects.least_cosine2;
  record.sine = sensor.defects.sine;
  record.cosine = sensor.defects.cosine;
  // See AddRangeErrors().
  record.fraction = finite(settings.range_noise);
  record.deviation = std::sqrt(std::max(0.0, finite(settings.range_noise_const)));
  record.min_range =
      settings.range.min < settings.range.max && settings.range.min > 0 ? settings.range.min : 0.0;
  record.max_range = settings.range.max;
  return record;
}

void ImageMaker::AddSensors() {
  std::vector<row_sensor_t> sensors;
  std::vector<uint32_t> others, sensor_of(scene_.ray_count);
  std::vector<double> bearings(scene_.ray_count);
  for (uint32_t k = 0; k < scene_.sensors.size(); k++) {
    const Sensor& sensor = scene_.sensors[k];
    sensors.push_back(RecordOfSensor(sensor));
    sensors.back().node = static_cast<uint32_t>(nodes_.size());
    AddNode(scene_.movers[sensor.mover], sensor.node, &sensor.settings->pose);
    sensors.back().first_other = static_cast<uint32_t>(others.size());
    sensors.back().others = static_cast<uint32_t>(sensor.others.size());
    others.insert(others.end(), sensor.others.begin(), sensor.others.end());
    std::fill_n(sensor_of.begin() + sensor.first_ray, sensor.rays, k);
    std::copy_n(sensor.settings->bearings.begin(), sensor.rays,
                bearings.begin() + sensor.first_ray);
  }
  DeviceViews views(scene_, &sensors);
  SetPart(ROW_NODES, nodes_);
  SetPart(ROW_LINKS, links_);
  SetPart(ROW_SENSORS, sensors);
  SetPart(ROW_OTHERS, others);
  SetPart(ROW_SENSOR_OF, sensor_of);
  SetPart(ROW_BEARINGS, bearings);
  SetPart(ROW_DIRECTIONS, scene_.directions.all());
  SetPart(ROW_UNIT_VECTORS, scene_.directions.unit_vectors());
  SetPart(ROW_WALLS, views.walls());
  SetPart(ROW_FRAGMENTS, views.fragments());
  SetPart(ROW_WALL_CORNERS, views.corners());
  std::vector<row_view_t> records;
  for (const DeviceViews::View& view : views.views())
    records.push_back({Append(std::span(view.tile_maps)), Append(std::span(view.tiles)),
                       Append(std::span(view.of_tiles)), Append(std::span(view.lists))});
  SetPart(ROW_VIEWS, records);
}

void ImageMaker::AddControls() {
  if (!WhyNotControls(scene_).empty()) return;  // the host calls them
  const DeviceControls controls(scene_);
  SetPart(ROW_CONTROLLED, controls.driven());
  SetPart(ROW_CONTROLS, controls.records());
  SetPart(ROW_POSITIONS, controls.positions());
  SetPart(ROW_LAYOUTS, controls.layouts());
  SetPart(ROW_LOOK_OF, controls.look_of());
  header_.driven = static_cast<uint32_t>(controls.driven().size());
  header_.controls = static_cast<uint32_t>(controls.records().size());
  header_.looks = static_cast<uint32_t>(controls.look_of().size());
  header_.positions = static_cast<uint32_t>(controls.positions().size());
  header_.needs_velocities = controls.needs_velocities();
}

void ImageMaker::AddContacts() {
  const DeviceContacts contacts(scene_, contact_bytes_);
  SetPart(ROW_TOUCHERS, contacts.touchers());
  SetPart(ROW_PIECES, contacts.pieces());
  SetPart(ROW_TOUCH_CORNERS, contacts.corners());
  SetPart(ROW_EDGES, contacts.edges());
  SetPart(ROW_EDGE_STARTS, contacts.edge_starts());
  SetPart(ROW_EDGE_ENTRIES, contacts.edge_entries());
  contacts.Fill(&header_);
}

void ImageMaker::AddMaps() {
  std::vector<row_map_t> maps;
  for (const std::vector<CellMap>* some : {&scene_.blocked, &scene_.seen})
    for (const CellMap& map : *some) {
      const CellMap::Content c = map.content();
      maps.push_back({c.x, c.y, c.width, c.height, Append(c.distances), Append(c.bits),
                      static_cast<uint64_t>(c.words), 0});
    }
  SetPart(ROW_MAPS, maps);
  SetPart(ROW_DIRECTORY, scene_.grid.directory());
  SetPart(ROW_REGIONS, scene_.grid.region_tables());
  SetPart(ROW_REGION_MAPS, scene_.grid.region_maps());
  const ray_grid_t view = scene_.grid.View(internal::grid::kEverything);
  header_.directory_mask = view.directory_mask;
  header_.min_x = view.min_x;
  header_.min_y = view.min_y;
  header_.max_x = view.max_x;
  header_.max_y = view.max_y;
}

/// The columns of a world in its state after loading.
void ImageMaker::AddStart() {
  std::vector<std::byte> start;
  ForEachDeviceColumn(&start_.columns, [&](int id, const auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    header_.row_bytes[id] = column->size() * kSizeOnDevice<T>;
    header_.starts[id] = start.size();
    start.resize(Aligned(start.size() + header_.row_bytes[id]));
    ToDevice(column->data(), column->size(), start.data() + header_.starts[id]);
  });
  SetPart(ROW_START, start);
}

void ImageMaker::PlaceColumns() {
  for (int id = 0; id < ROW_COLUMNS; id++) {
    header_.columns[id] = state_bytes_;
    state_bytes_ = Aligned(state_bytes_ + worlds_ * header_.row_bytes[id]);
  }
  header_.lock = state_bytes_;
  header_.counts = header_.lock + sizeof(uint64_t);
  state_bytes_ += ROW_ALIGNMENT;
}

void ImageMaker::PlaceScratch() {
  size_t end = 0;
  const auto place = [&](int which, size_t bytes) {
    header_.scratch[which] = end;
    end = Aligned(end + bytes);
  };
  const bool turns = std::ranges::any_of(scene_.sensors, &Sensor::turns_noisily);
  place(ROW_FANS, scene_.sensors.size() * sizeof(row_fan_t));
  place(ROW_OWN_RAYS, turns ? scene_.ray_count * sizeof(row_own_ray_t) : 0);
  place(ROW_POINTS, header_.any_exact ? scene_.point_count * sizeof(row_point_t) : 0);
  place(ROW_WANTED, scene_.movers.size() * sizeof(row_wanted_t));
  place(ROW_CELLS, corner_count_ * sizeof(row_cell_t));
  place(ROW_DRAWN, scene_.bodies.size() * sizeof(row_drawn_t));
  place(ROW_OVERLAPS, header_.groups * sizeof(row_overlaps_t));
  place(ROW_DRAWN_BITS, scene_.byte_count);
  place(ROW_LOOKS, header_.looks * sizeof(row_look_t));
  place(ROW_ALL_POSES, header_.positions * sizeof(row_planar_t));
  place(ROW_ALL_VELOCITIES,
        header_.needs_velocities ? header_.positions * sizeof(row_planar_t) : 0);
  const size_t touchers = header_.touchers;
  place(ROW_CONTACTS, touchers * sizeof(row_contact_t));
  place(ROW_NEAR_BITS, touchers * ((touchers + 31) / 32) * sizeof(uint32_t));
  place(ROW_MEMBERS, touchers * sizeof(uint32_t));
  place(ROW_ISLANDS, touchers * sizeof(row_island_t));
  header_.scratch_bytes = end;
  header_.most_waiting = static_cast<uint32_t>(worlds_ * touchers);
  header_.first_room = worlds_ * end;
  header_.shared_room = header_.first_room + worlds_ * header_.rooms[0].bytes;
  header_.waiting = header_.shared_room + header_.rooms[1].bytes;
  scratch_bytes_ =
      header_.waiting + ROW_ISLAND_KINDS * header_.most_waiting * sizeof(row_waiting_t);
}

DeviceImage ImageMaker::Make() {
  const auto number = [](size_t count) { return static_cast<uint32_t>(count); };
  header_.step = scene_.step;
  header_.interval = scene_.IsIdle() ? 1 : scene_.rates[0].models[0]->GetUpdateInterval();
  header_.cells_per_metre = scene_.cells_per_metre;
  header_.seconds = static_cast<double>(scene_.step) / kSecond;
  header_.movers = number(scene_.movers.size());
  header_.bodies = number(scene_.bodies.size());
  header_.sensors = number(scene_.sensors.size());
  header_.rays = scene_.ray_count;
  header_.packs = number(scene_.packs.size());
  header_.consumers = number(scene_.consumers.size());
  header_.bytes = scene_.byte_count;
  header_.narrow = scene_.narrow;
  header_.any_exact = std::ranges::any_of(scene_.sensors, &Sensor::exact);
  header_.any_noise = scene_.HasNoise();
  header_.needs_rays = scene_.needs_rays;
  header_.varies_movers = scene_.varies_movers;
  header_.varies_noise = scene_.varies_noise;
  for (const int id : {ROW_SEED, ROW_VARIED, ROW_PROPERTIES, ROW_RANGE_NOISE})
    header_.kept |= uint64_t{1} << id;
  AddMovers();
  AddBodies();
  AddSensors();
  AddControls();
  AddContacts();
  AddMaps();
  AddStart();
  PlaceColumns();
  PlaceScratch();
  std::memcpy(bytes_.data(), &header_, sizeof header_);
  DeviceImage image{std::vector<uint64_t>(bytes_.size() / sizeof(uint64_t)), state_bytes_,
                    scratch_bytes_};
  std::memcpy(image.words.data(), bytes_.data(), bytes_.size());
  return image;
}

/// True if devices have all columns of the rows. How worlds were reseeded matters on the host only.
bool HasAllColumns(Rows* rows) {
  size_t bytes = sizeof rows->columns.reseeding[0];
  ForEachDeviceColumn(&rows->columns, [&](int, const auto* column) {
    bytes += column->size() * sizeof((*column)[0]);
  });
  return bytes == rows->BytesPerWorld();
}

}  // namespace

std::string WhyNotOnDevice(const std::shared_ptr<const Scene>& scene) {
  if (!scene->HasOneRate()) return "its models have several update intervals";
  if (!scene->wall_parts.empty())
    return "its contacts are those of outlines, and models that stand are placed in each world";
  if (std::string reason = WhyNotContacts(*scene); !reason.empty()) return reason;
  if (scene->finders.any) return "a bumper, fiducial finder or blobfinder runs";
  for (const Mover& mover : scene->movers) {
    if (!mover.runs) continue;
    const auto is = [&](motion::BuiltInDrive kind) {
      return mover.function == motion::DriveOf(kind).function;
    };
    if (!is(motion::kDifferential) && !is(motion::kOmni) && !is(motion::kCar))
      return messages::Quoted(mover.model->TokenStr()) + " has a drive of a plug-in";
  }
  Rows one(scene, std::array{scene->SomeSeed()});
  if (!HasAllColumns(&one)) return "devices lack a column that its rows have";
  return "";
}

DeviceImage MakeDeviceImage(const std::shared_ptr<const Scene>& scene, size_t worlds,
                            size_t contact_bytes) {
  STAGE_ASSERT(WhyNotOnDevice(scene).empty());
  return ImageMaker(scene, worlds, contact_bytes).Make();
}

}  // namespace Stg::rows
