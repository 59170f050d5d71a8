// SPDX-License-Identifier: GPL-2.0-or-later
//
// Saves and restores the rows of snapshots. Sections of a row: the list of models; one byte per
// model that tells whether its readings are left out; the world's own state; the state of each
// model; and the three parts of World::ExchangeState() that follow the models.

#ifndef STAGE_WORLD_RESTORER_HH
#define STAGE_WORLD_RESTORER_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "models/state_exchange.hh"
#include "world/engine.hh"
#include "world/snapshot_buffers.hh"
#include "world/state_row.hh"
#include "world/world.hh"

namespace Stg {

/// For each model, in the order of creation: whether its readings are left out. If empty, none are.
using OmittedReadings = std::vector<unsigned char>;

/// Saves or restores one row, and makes models in a world that has been loaded. Its functions must
/// be called in the order of declaration.
class World::Restorer {
 public:
  explicit Restorer(World* world)
      : world_(*world), engine_(*world->engine_), buffers_(*engine_.snapshot_buffers) {}

  /// Flags the models that update in the next step, before anything can read their readings.
  OmittedReadings FindDue();
  void Save(const OmittedReadings& omitted, StateRow* row);
  /// True if restoring this row cannot fail half-way: the world has the same models with the same
  /// parts and callbacks as the world that it was saved from, in this process.
  bool Fits(const StateRow& row);
  /// Restores a row that fits. Returns "" or an error; after an error the world may be in any
  /// state.
  std::string RestoreDirectly(const StateRow& row);
  /// Restores any row. Returns "" or an error, with the world unchanged. `validates`: the row is
  /// not from this process, so that it may be inconsistent.
  std::string RestoreOrPutBack(const StateRow& row, bool validates);

  /// Makes the models of a macro of the world file, and adds their entities to the file. Returns
  /// the one that stands on the ground, or null after a message.
  Model* MakeMacro(const std::string& macro);

 private:
  /// Indices of the sections. The three others follow the models.
  static constexpr size_t kList = 0, kOmitted = 1, kHead = 2, kModels = 3, kOtherSections = 6;

  /// An entry of the list of models.
  struct Listed {
    uint32_t id = 0;
    uint32_t parent = 0;  // index of the parent in the list + 1; 0: none
    int entity = 0;       // index in the world file; 0: none
    std::string type;

    void ExchangeState(StateExchange& exchange) { exchange(id, parent, entity, type); }
  };

  // In restore_fit.cc.
  const ModelList& List();
  const StateRow::Bytes& Names();
  bool HasModelsOf(const StateRow& row);
  uint64_t Fit();
  static bool AddFit(const Model& model, ModelList::Parts parts, uint64_t* hash);
  uint32_t PlaceOf(const Model* model) const;

  static OmittedReadings OmittedReadingsOf(const StateRow& row);
  bool IsIn(const StateRow& row) const;
  void PutBack(const StateRow& before);
  void ReleaseIds();
  std::string RestoreChanged(const StateRow& row, const StateRow& before);
  std::string RestoreSections(const StateRow& row, const std::function<bool(size_t)>& is_same);
  void DropReadings(const StateRow& row);

  // In macro_models.cc.
  void LoadAdded(int first);
  void DeleteAdded(int first);

  // In restore_models.cc.
  std::string RestoreAll(const StateRow& row);
  std::string ReadList(const StateRow& row);
  std::string Check() const;
  bool HasCycle() const;
  bool Fits(const Listed& listed) const;
  void FindModels();
  void MakeMissing();
  Model* Make(const Listed& listed, Model* parent);
  void LoadParts(Model* model, int entity);
  void Arrange();
  bool IsTree() const;
  void EraseSurplus();
  void DeleteSurplus();

  World& world_;
  WorldEngine& engine_;
  SnapshotBuffers& buffers_;
  std::vector<Listed> list_;
  std::vector<Model*> models_;   // one per entry of list_
  std::vector<Model*> surplus_;  // models not in the list, to be deleted
  std::vector<size_t> created_;  // indices of created models in the list
};

}  // namespace Stg

#endif
