// SPDX-License-Identifier: GPL-2.0-or-later
//
// A scene whose map has changed against a scene that is newly made from a world with that map: rows
// of both step with equal bits.

#include "rows/changing_map.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/load_error.hh"
#include "rows/device_image.hh"
#include "rows/device_rows.hh"
#include "rows/row_bridge.hh"
#include "rows/row_words.hh"
#include "stage.hh"
#include "support/closed_world.hh"
#include "support/counted_allocations.hh"
#include "support/host_row_device.hh"
#include "support/model_testing.hh"
#include "support/random_source.hh"
#include "world/engine.hh"
#include "world/snapshot.hh"

namespace {

using Stg::rows::ChangingMap;
using Stg::rows::Rows;
using Stg::rows::RowWords;
using Stg::test::ClosedWorldKind;
using Stg::test::RandomSource;

/// Cells of a map, the lowest row first.
struct Cells {
  int columns, rows;
  std::vector<uint8_t> occupied;

  Cells(int of_columns, int of_rows)
      : columns(of_columns),
        rows(of_rows),
        occupied(static_cast<size_t>(of_columns) * static_cast<size_t>(of_rows)) {}
  uint8_t& At(int x, int y) {
    return occupied[static_cast<size_t>(y) * static_cast<size_t>(columns) + static_cast<size_t>(x)];
  }
  bool Any() const { return std::ranges::count(occupied, 0) < std::ssize(occupied); }

  /// A binary PBM file, whose first row is the highest.
  std::string Pbm() const {
    std::string content = "P4\n" + std::to_string(columns) + " " + std::to_string(rows) + "\n";
    for (int y = rows - 1; y >= 0; y--) {
      std::string row(static_cast<size_t>(columns + 7) / 8, '\0');
      for (int x = 0; x < columns; x++)
        if (const_cast<Cells*>(this)->At(x, y))
          row[static_cast<size_t>(x) / 8] |= static_cast<char>(0x80 >> x % 8);
      content += row;
    }
    return content;
  }
};

/// Rooms with doors.
void DrawRooms(RandomSource* random, Cells* cells) {
  const int side = random->Int(3, 9), door = random->Int(0, side - 1);
  for (int y = 0; y < cells->rows; y++)
    for (int x = 0; x < cells->columns; x++)
      cells->At(x, y) = (x % side == 0 && y % side != door) || (y % side == 0 && x % side != door);
}

/// A grid of one of several kinds: without cells, full, noise, one cell, a border, rooms, few
/// changes.
Cells RandomCells(RandomSource* random, const Cells& before) {
  Cells cells(before.columns, before.rows);
  const int kind = random->Int(0, 9);
  constexpr uint64_t kShares[] = {100, 10, 2};
  if (kind == 1) std::ranges::fill(cells.occupied, random->OneIn(2) ? 1 : 255);
  if (kind >= 2 && kind <= 4)
    for (uint8_t& cell : cells.occupied) cell = random->OneIn(kShares[kind - 2]) ? 1 : 0;
  if (kind == 5) cells.At(random->Int(0, cells.columns - 1), random->Int(0, cells.rows - 1)) = 1;
  if (kind == 6)
    for (int y = 0; y < cells.rows; y++)
      for (int x = 0; x < cells.columns; x++)
        cells.At(x, y) = x == 0 || y == 0 || x == cells.columns - 1 || y == cells.rows - 1;
  if (kind == 7) DrawRooms(random, &cells);
  if (kind >= 8) {
    cells = before;
    for (int i = random->Int(1, 5); i > 0; i--) {
      uint8_t& cell = cells.At(random->Int(0, cells.columns - 1), random->Int(0, cells.rows - 1));
      cell = !cell;
    }
  }
  return cells;
}

/// A world file with a map, written as GridMap of the Python package writes it.
struct MapWorld {
  std::string before, map, after;  ///< parts of the file; the map without its picture
  uint64_t idle;                   ///< see SubscribeToMost()
  uint64_t placed = 0;             ///< things that each world places, as bits like `idle`

  std::string Text(const Cells& cells) const {
    const std::string body =
        cells.Any() ? "bitmap \"map.pbm\" bitmap_frame \"picture\"" : "noblocks 1";
    return before + map + body + " gui_move 0 )\n" + after;
  }
  std::unique_ptr<Stg::World> Load(const Cells& cells) const {
    Stg::InitLibrary();
    Stg::RunOptions options;
    options.seed = 7;
    options.threads = 1;
    options.listed = false;
    options.pictures = std::make_shared<const std::map<std::string, std::string>>(
        std::map<std::string, std::string>{{"map.pbm", cells.Pbm()}});
    auto world = std::make_unique<Stg::World>(options);
    std::istringstream content(Text(cells));
    EXPECT_TRUE(world->Load(content, "t.world")) << Text(cells);
    Stg::test::SubscribeToMost(world.get(), idle);
    for (const Stg::Model* model : world->engine().models)
      if (model->GetModelType() == "model" && !model->Parent() && model->TokenStr() != "map" &&
          ((placed >> (model->GetId() % 64)) & 1) != 0)
        world->engine().placed.push_back(model->GetId());
    return world;
  }
};

std::string MapText(const Cells& cells, RandomSource* random) {
  const double side = random->Pick<double>({0.05, 0.05, 0.1, 0.17, 0.3});
  const double width = cells.columns * side, height = cells.rows * side;
  const auto number = [](double value) { return std::to_string(value); };
  const double heading = random->Pick<double>({0, 0, 0, 90, random->Real(-180, 180)});
  return "model( name \"map\" pose [" + number(random->Real(-1, 0.5) * width) + " " +
         number(random->Real(-1, 0.5) * height) + " 0 " + number(heading) + "] origin [" +
         number(width / 2) + " " + number(height / 2) + " 0 0] size [" + number(width) + " " +
         number(height) + " " + number(random->OneIn(3) ? random->Real(0.05, 0.5) : 1) + "] " +
         (random->OneIn(5) ? "ranger_return 0.3 " : "") +
         (random->OneIn(10) ? "obstacle_return 0 " : "") +
         (random->OneIn(10) ? "ranger_return -1 " : "");
}

MapWorld RandomMapWorld(RandomSource* random, const Cells& cells, uint64_t number) {
  const ClosedWorldKind kind{number % 3 != 0,    false,           random->Int(1, 5),
                             random->Real(1, 4), number % 4 == 0, number % 5 == 0};
  const std::string text = ClosedWorld(kind, random), map = MapText(cells, random);
  size_t place = 0;
  for (int line = 0; line < 4; line++) place = text.find('\n', place) + 1;
  if (random->OneIn(3)) place = text.size();
  return {text.substr(0, place), map, text.substr(place),
          random->OneIn(4) ? random->Next() & random->Next() : 0,
          number % 3 == 1 ? random->Next() : 0};
}

std::vector<uint64_t> WordsOf(const Rows& rows) {
  const RowWords words(rows.scene());
  std::vector<uint64_t> all(words.Count(false));
  words.Save(rows, 0, all.data());
  return all;
}

/// Rows of a scene, and their scratch.
struct Stepped {
  Rows rows;
  std::shared_ptr<Rows::Scratch> scratch;

  explicit Stepped(const std::shared_ptr<const Stg::rows::Scene>& scene)
      : rows(scene, std::array<uint64_t, 1>{7}), scratch(rows.MakeScratch()) {}

  void Command(size_t i, double x, double y, double a) {
    rows.columns.mode[i] = 1;
    rows.columns.command[i] = {x, y, a};
  }
  std::vector<double> Contacts() {
    std::vector<Stg::ContactPoint> contacts;
    rows.FindContacts(0, scratch.get(), &contacts);
    std::vector<double> all;
    for (const Stg::ContactPoint& contact : contacts)
      all.insert(all.end(),
                 {double(contact.a->GetId()), double(contact.b->GetId()), contact.point.x,
                  contact.point.y, contact.normal.x, contact.normal.y, contact.gap});
    return all;
  }
};

/// Events in rows, which show that the worlds exercise the code.
struct Events {
  size_t worlds = 0, with_placed_walls = 0, hits = 0, stalls = 0, contacts = 0, bumps = 0,
         equal_hashes = 0;

  void Count(const Rows& rows) {
    for (const uint8_t brightness : rows.columns.brightness) hits += brightness > 0;
    for (const uint8_t stalled : rows.columns.stalled) stalls += stalled;
    for (const Stg::rows::Bump& bump : rows.columns.bumps)
      bumps += bump.model != Stg::rows::Bump::kNobody;
  }
};

/// Gives the same random commands in both, and to the robots of a world.
void CommandAll(RandomSource* random, Stepped* one, Stepped* other, Stg::World* world) {
  const auto& movers = one->rows.scene().movers;
  for (size_t i = 0; i < movers.size(); i++) {
    if (!movers[i].robot || random->OneIn(3)) continue;
    const double x = random->Real(-1, 1), y = random->Real(-1, 1), a = random->Real(-2, 2);
    one->Command(i, x, y, a);
    other->Command(i, x, y, a);
    dynamic_cast<Stg::ModelPosition&>(*world->FindModel(movers[i].model->GetId()))
        .SetSpeed(x, y, a);
  }
}

/// Steps rows of the changed scene, of a new scene and a world. Returns what differs first.
std::string FirstDifference(const MapWorld& file, const Cells& cells, Stepped* changed,
                            RandomSource* random, Events* events) {
  std::string reason;
  const auto scene = Stg::RowBridge::MakeScene(file.Load(cells), &reason);
  if (!scene) return "no scene, because " + reason;
  Stepped fresh(scene);
  changed->rows.Reset(0, 7);
  const auto world = file.Load(cells), written = file.Load(cells);
  for (int step = 0; step < 12; step++) {
    if (WordsOf(changed->rows) != WordsOf(fresh.rows))
      return "other words before step " + std::to_string(step);
    const std::vector<double> contacts = fresh.Contacts();
    events->contacts += contacts.size();
    if (changed->Contacts() != contacts)
      return "other contacts before step " + std::to_string(step);
    if (step % 4 == 0) CommandAll(random, changed, &fresh, world.get());
    changed->rows.Step(0, 1, changed->scratch.get());
    fresh.rows.Step(0, 1, fresh.scratch.get());
    world->Update();
    events->Count(changed->rows);
  }
  fresh.rows.columns = changed->rows.columns;
  if (!Stg::RowBridge::Write(fresh.rows, 0, written.get())) return "the row cannot be written";
  if (world->StateHash() != written->StateHash()) return "other hash than the world";
  events->equal_hashes++;
  return "";
}

/// Number of random worlds; more for a long search.
uint64_t Worlds() {
  const char* const wanted = std::getenv("STAGE_RANDOM_WORLDS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : 120;
}

TEST(ChangingMap, RowsStepLikeThoseOfANewSceneWithThatMap) {
  Events events;
  for (uint64_t number = 1; number <= Worlds(); number++) {
    RandomSource random(number * 77);
    Cells cells(random.Int(1, 70), random.Int(1, 40));
    do cells = RandomCells(&random, cells);
    while (!cells.Any());
    const MapWorld file = RandomMapWorld(&random, cells, number);
    std::string reason;
    const auto map = ChangingMap::Make(file.Load(cells), "map", &reason);
    if (!map) {
      EXPECT_TRUE(reason.find("exact") != reason.npos ||
                  reason.find("populations") != reason.npos ||
                  reason.find("cells or corners") != reason.npos)
          << reason << "\n"
          << file.Text(cells);
      continue;
    }
    events.worlds++;
    events.with_placed_walls += !map->scene()->wall_parts.empty();
    Stepped changed(map->scene());
    for (int change = 0; change < 6; change++) {
      ASSERT_EQ(FirstDifference(file, cells, &changed, &random, &events), "")
          << number << " change " << change << "\n"
          << file.Text(cells);
      ASSERT_EQ(map->scene()->grid.Validate(), "") << number << " change " << change;
      const Cells before = cells;
      cells = RandomCells(&random, cells);
      const uint64_t version = map->version();
      const bool differs =
          !std::ranges::equal(cells.occupied, before.occupied,
                              [](uint8_t a, uint8_t b) { return (a != 0) == (b != 0); });
      ASSERT_EQ(map->Set(cells.occupied), differs);
      EXPECT_EQ(map->version() != version, differs);
    }
  }
  EXPECT_GT(events.worlds, 40u);
  EXPECT_GT(events.with_placed_walls, 5u);
  EXPECT_GT(events.hits, 10000u);
  EXPECT_GT(events.stalls, 100u);
  EXPECT_GT(events.contacts, 100u);
  EXPECT_GT(events.bumps, 20u);
  EXPECT_GT(events.equal_hashes, 200u);
}

/// A room with a robot, a ranger and a box that overlaps the map.
MapWorld SmallWorld(const std::string& contacts) {
  return {"resolution 0.02\ncontacts \"" + contacts + "\"\n",
          "model( name \"map\" pose [-1.5 -1 0 0] origin [1.5 1 0 0] size [3 2 1] ",
          "model( size [0.3 0.2 0.5] pose [0.4 0.3 0 20] )\n"
          "position( name \"r\" size [0.2 0.2 0.3] ranger( sensor( range [0 3] samples 16 ) ) )\n",
          0};
}

/// Steps rows of a changed scene on a device and on the host. Returns what differs first.
std::string DeviceDifference(ChangingMap* map, std::shared_ptr<Stg::rows::RowDevice> device,
                             RandomSource* random, Events* events) {
  Stg::rows::DeviceRows on_device(map->scene(), 1, std::move(device));
  Stepped host(map->scene());
  Rows back(map->scene(), std::array<uint64_t, 1>{7});
  Cells cells(map->columns(), map->rows());
  for (int change = 0; change < 4; change++) {
    if (on_device.Renew() != (change > 0)) return "the image is not that of the map";
    host.rows.Reset(0, 7);
    for (size_t i = 0; i < host.rows.scene().movers.size(); i++)
      host.Command(i, random->Real(0.3, 1), 0, random->Real(-1, 1));
    on_device.Write(host.rows);
    on_device.Step(15);
    on_device.Read(&back);
    host.rows.Step(0, 15, host.scratch.get());
    events->Count(host.rows);
    if (WordsOf(back) != WordsOf(host.rows)) return "change " + std::to_string(change);
    while (!map->Set(cells.occupied)) cells = RandomCells(random, cells);
  }
  return "";
}

TEST(ChangingMap, DevicesStepLikeTheHostOnceTheyHaveTheNewMap) {
  Events events;
  for (uint64_t number = 1; number <= 12; number++) {
    RandomSource random(number);
    Cells cells(60, 40);
    DrawRooms(&random, &cells);
    std::string reason;
    const MapWorld file = SmallWorld(number % 2 ? "outlines" : "cells");
    const auto map = ChangingMap::Make(file.Load(cells), "map", &reason);
    ASSERT_TRUE(map) << reason;
    ASSERT_EQ(Stg::rows::WhyNotOnDevice(map->scene()), "");
    std::shared_ptr<Stg::rows::RowDevice> device =
        number < 11 ? std::make_unique<Stg::test::HostRowDevice>()
                    : Stg::rows::OpenRowDevice("", 0, &reason);
    ASSERT_TRUE(device) << reason;
    EXPECT_EQ(DeviceDifference(map.get(), device, &random, &events), "") << number;
  }
  EXPECT_GT(events.hits, 200u);
  EXPECT_GT(events.stalls, 5u);
}

TEST(ChangingMap, ChangesAllocateNothingOnceMemoryHasGrown) {
  for (const char* const contacts : {"outlines", "cells"}) {
    RandomSource random(5);
    Cells cells(60, 40), chess = cells;
    cells.At(3, 3) = 1;
    for (int y = 0; y < 40; y++)
      for (int x = 0; x < 60; x++) chess.At(x, y) = (x + y) % 2 == 1;
    std::string reason;
    const auto map = ChangingMap::Make(SmallWorld(contacts).Load(cells), "map", &reason);
    ASSERT_TRUE(map) << reason;
    // The most corners, and then the most cells that can lie in one tile.
    std::vector<Cells> grids{chess, Cells(60, 40)};
    for (int i = 0; i < 30; i++) grids.push_back(RandomCells(&random, grids.back()));
    for (int i = 0; i < 2; i++)
      for (const Cells& grid : grids) map->Set(grid.occupied);
    const long before = test::allocations;
    size_t changes = 0;
    for (int i = 0; i < 10000; i++) {
      Cells& grid = grids[static_cast<size_t>(random.Int(0, 31))];
      if (random.OneIn(2)) {
        uint8_t& cell = grid.At(random.Int(0, 59), random.Int(0, 39));
        cell = !cell;
      }
      changes += map->Set(grid.occupied);
    }
    EXPECT_EQ(test::allocations - before, 0) << contacts;
    EXPECT_GT(changes, 8000u);
  }
}

TEST(ChangingMap, AGridWithTooManyCornersChangesNothing) {
  // 600 x 600 cells that touch at their corners have 720 000 corners.
  const MapWorld file{"resolution 0.1\n", "model( name \"map\" origin [30 30 0 0] size [60 60 1] ",
                      "position( name \"r\" pose [30 30 0 0] ranger( sensor( samples 16 ) ) )\n",
                      0};
  Cells cells(600, 600), chess = cells;
  cells.At(310, 300) = 1;
  for (int y = 0; y < 600; y++)
    for (int x = 0; x < 600; x++) chess.At(x, y) = (x + y) % 2 == 1;
  std::string reason;
  const auto map = ChangingMap::Make(file.Load(cells), "map", &reason);
  ASSERT_TRUE(map) << reason;
  Stepped rows(map->scene());
  rows.rows.Step(0, 2, rows.scratch.get());
  const std::vector<uint64_t> words = WordsOf(rows.rows);
  const uint64_t version = map->version();
  EXPECT_THROW(map->Set(chess.occupied), Stg::LoadError);
  EXPECT_EQ(map->version(), version);
  rows.rows.Reset(0, 7);
  rows.rows.Step(0, 2, rows.scratch.get());
  EXPECT_EQ(WordsOf(rows.rows), words);
  EXPECT_FALSE(map->Set(cells.occupied));
}

/// Why a world of this text has no map that can change.
std::string ReasonOf(const std::string& text) {
  const MapWorld file{"resolution 0.02\n", "", "", 0};
  Cells cells(8, 4);
  cells.At(2, 1) = 1;
  MapWorld given = file;
  given.before += text + "\nmodel( size [0.1 0.1 0.1] ";
  std::string reason;
  EXPECT_FALSE(ChangingMap::Make(given.Load(cells), "map", &reason)) << text;
  return reason;
}

TEST(ChangingMap, ReasonsNameWhatIsWrong) {
  const std::string picture = " bitmap \"map.pbm\" bitmap_frame \"picture\" ";
  EXPECT_EQ(ReasonOf(""), "no model has the name \"map\"");
  EXPECT_EQ(ReasonOf("model( name \"map\" )"),
            "\"map\" has no bitmap with an occupied cell and bitmap_frame \"picture\"");
  EXPECT_EQ(ReasonOf("model( name \"map\" bitmap \"map.pbm\" bitmap_frame \"dark\" )"),
            "\"map\" has no bitmap with an occupied cell and bitmap_frame \"picture\"");
  EXPECT_EQ(ReasonOf("model( name \"map\" boundary 1" + picture + ")"),
            "\"map\" has no bitmap with an occupied cell and bitmap_frame \"picture\"");
  EXPECT_EQ(ReasonOf("model( name \"map\" model( size [1 1 1] )" + picture + ")"),
            "\"map\" moves, is placed by each world, or is part of a tree");
  EXPECT_EQ(ReasonOf("model( name \"map\"" + picture +
                     ") position( name \"r\" ranger( sensor( ray_model \"exact\" ) ) )"),
            "a ray is of the exact model, for which a map cannot change");
  EXPECT_EQ(ReasonOf("model( name \"map\" size [4e4 2e4 1]" + picture + ")"),
            "\"map\" has too many cells (a coarser resolution is possible)");
}

}  // namespace
