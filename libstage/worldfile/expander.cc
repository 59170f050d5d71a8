// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/expander.hh"

#include <algorithm>
#include <string>
#include <utility>

#include "geometry/load_error.hh"

namespace Stg::worldfile {

Expander::Expander(Document& document) : document_(document) {
  for (std::uint32_t number = 0; number < document_.macros.size(); ++number) {
    NoteMacro(document_.macros[number].name, number);
  }
}

void Expander::AddMacro(Macro macro) {
  NoteMacro(macro.name, static_cast<std::uint32_t>(document_.macros.size()));
  document_.macros.push_back(std::move(macro));
}

void Expander::NoteMacro(std::uint32_t name, std::uint32_t number) {
  if (macro_of_name_.size() <= name) macro_of_name_.resize(name + 1U, kNone);
  macro_of_name_[name] = number;
}

const Macro* Expander::FindMacro(std::uint32_t name) const {
  const std::uint32_t number = MacroNumber(name);
  return number == kNone ? nullptr : &document_.macros[number];
}

std::uint32_t Expander::MacroNumber(std::uint32_t name) const {
  return name < macro_of_name_.size() ? macro_of_name_[name] : kNone;
}

void Expander::Expand(const Child& child) {
  outermost_ = &child;
  ExpandUnder(child, 0, 1);
}

// Adds children of base macros first, those of the instance last. CheckLimits() bounds the
// recursion depth.
void Expander::ExpandUnder(const Child& child, std::uint32_t parent, std::size_t depth) {
  CheckLimits(child, depth);
  const std::uint32_t chain = ResolveChain(child);
  CheckUsable(document_.chains[chain], child);
  const auto entity = static_cast<std::uint32_t>(document_.entities.size());
  document_.entities.push_back(
      {child.body, chain, child.name_token, static_cast<std::int32_t>(parent)});

  for (std::size_t i = document_.chains[chain].macros.size(); i-- > 0;) {
    // By index: the arrays of chains and macros may be reallocated during the expansion.
    const std::uint32_t macro = document_.chains[chain].macros[i];
    document_.macros[macro].expanding = true;
    ExpandChildren(document_.macros[macro].body, entity, depth);
    document_.macros[macro].expanding = false;
  }
  ExpandChildren(child.body, entity, depth);
}

void Expander::ExpandChildren(std::uint32_t body, std::uint32_t parent, std::size_t depth) {
  const Body& from = document_.bodies[body];
  for (std::uint32_t i = 0; i < from.child_count; ++i) {
    ExpandUnder(document_.children[from.first_child + i], parent, depth + 1);
  }
}

void Expander::CheckLimits(const Child& child, std::size_t depth) const {
  if (depth > kMaxNesting) {
    document_.Fail(document_.tokens[child.name_token],
                   "found entities nested more than " + std::to_string(kMaxNesting) + " deep in " +
                       Quoted(document_.names.Text(outermost_->name)) + ", expected fewer");
  }
  const std::size_t max_entities = std::min(
      kMaxEntities, kMaxMadeEntities + kMaxEntitiesPerWritten * document_.written_entities);
  if (document_.entities.size() > max_entities) {
    const bool macro = MacroNumber(outermost_->name) != kNone;
    document_.Fail(
        document_.tokens[outermost_->name_token],
        "found more than " + std::to_string(max_entities) + " entities" +
            (macro ? " while expanding macro " : " at ") +
            Quoted(document_.names.Text(outermost_->name)) +
            (max_entities < kMaxEntities ? ", expected fewer, given the number written in the file"
                                         : ", expected fewer"));
  }
}

void Expander::CheckUsable(const Chain& chain, const Child& child) const {
  for (const std::uint32_t number : chain.macros) {
    const Macro& macro = document_.macros[number];
    if (!macro.error.empty()) throw LoadError(macro.error);
    // A macro used in its own body would expand infinitely.
    if (macro.expanding) FailRecursive(number, child);
  }
}

// The chain is cached in the macro until another macro is defined.
std::uint32_t Expander::ResolveChain(const Child& child) {
  const std::uint32_t number = MacroNumber(child.name);
  if (number == kNone) return PlainChain(child.name);
  Macro& macro = document_.macros[number];
  const auto now = static_cast<std::uint32_t>(document_.macros.size());
  if (macro.chain != kNone && macro.chain_made_at == now) return macro.chain;

  Chain chain = WalkBases(number, child);
  const bool same = macro.chain != kNone && document_.chains[macro.chain].type == chain.type &&
                    document_.chains[macro.chain].macros == chain.macros;
  if (!same) {
    macro.chain = static_cast<std::uint32_t>(document_.chains.size());
    document_.chains.push_back(std::move(chain));
  }
  macro.chain_made_at = now;
  return macro.chain;
}

std::uint32_t Expander::PlainChain(std::uint32_t type) {
  if (plain_chain_of_name_.size() <= type) plain_chain_of_name_.resize(type + 1U, kNone);
  std::uint32_t& chain = plain_chain_of_name_[type];
  if (chain == kNone) {
    chain = static_cast<std::uint32_t>(document_.chains.size());
    document_.chains.push_back({{}, type});
  }
  return chain;
}

Chain Expander::WalkBases(std::uint32_t macro, const Child& child) const {
  Chain chain;
  while (macro != kNone) {
    if (std::find(chain.macros.begin(), chain.macros.end(), macro) != chain.macros.end()) {
      FailRecursive(macro, child);
    }
    if (chain.macros.size() >= kMaxMacroChain) {
      document_.Fail(document_.tokens[child.name_token],
                     "found more than " + std::to_string(kMaxMacroChain) +
                         " macros based on one another in " +
                         Quoted(document_.names.Text(child.name)) + ", expected fewer");
    }
    chain.macros.push_back(macro);
    chain.type = document_.macros[macro].base;
    macro = MacroNumber(chain.type);
  }
  return chain;
}

void Expander::FailRecursive(std::uint32_t macro, const Child& child) const {
  const Macro& culprit = document_.macros[macro];
  document_.Fail(document_.tokens[child.name_token],
                 "recursive macro: found that macro " + Quoted(document_.names.Text(culprit.name)) +
                     ", defined at " +
                     document_.PlaceOf(document_.tokens[culprit.name_token]).Text() +
                     ", leads back to itself, expected an end");
}

void Expander::WarnOfUnusedErrors() {
  for (const Macro& macro : document_.macros) {
    if (macro.error.empty()) continue;
    document_.Warn(
        document_.tokens[macro.name_token],
        "macro " + Quoted(document_.names.Text(macro.name)) + " cannot be used: " + macro.error);
  }
}

}  // namespace Stg::worldfile
