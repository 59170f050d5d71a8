// SPDX-License-Identifier: GPL-2.0-or-later
//
// Base of World and Model: a name and children. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_ANCESTOR_HH
#define STAGE_MODELS_ANCESTOR_HH

#include <map>
#include <string>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class Model;
class StateExchange;
class World;

/// Returning non-zero removes the callback. Clients cast functions of other signatures to these
/// types, so they are plain function pointers.
typedef int (*model_callback_t)(Model* mod, void* user);
typedef int (*world_callback_t)(World* world, void* user);

class Ancestor {
 public:
  Ancestor();
  virtual ~Ancestor();

  /// Direct children in the order of creation. The reference stays up to date.
  std::vector<Model*>& GetChildren() { return children; }
  const std::vector<Model*>& GetChildren() const { return children; }
  /// Calls func for all descendants, parents before children. Ignores its result.
  void ForEachDescendant(model_callback_t func, void* arg);

  /// Number of children of the type created so far.
  unsigned int CountOfType(const std::string& type) const;
  virtual void AddChild(Model* mod);
  virtual void RemoveChild(Model* mod);
  virtual Pose GetGlobalPose() const;

  /// The full name.
  const char* Token() const { return token.c_str(); }
  const std::string& TokenStr() const { return token; }
  /// An empty name is refused with a message.
  virtual void SetToken(const std::string& str);

  /// Stores an untyped pointer under a name. Does not take ownership.
  void SetProperty(const std::string& key, void* value) { props[key] = value; }
  void* GetProperty(const std::string& key) const;

 protected:
  /// See Model::ExchangeState(). Restoring neither creates nor deletes children.
  void ExchangeState(StateExchange& exchange);
  void ExchangeTypeCounts(StateExchange& exchange);
  void RestoreTypeCounts(size_t types, StateExchange& exchange);
  /// Deletes the children, youngest first.
  void DeleteChildren();

  std::map<std::string, unsigned int> child_type_counts;
  std::vector<Model*> children;
  bool debug;
  std::map<std::string, void*> props;
  std::string token;

 private:
  Ancestor(const Ancestor&);
  Ancestor& operator=(const Ancestor&);
};

}  // namespace Stg

#endif
