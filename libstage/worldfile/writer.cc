// SPDX-License-Identifier: GPL-2.0-or-later
//
// Saving: the file's text is kept except for changed values, so its layout and comments remain. A
// written value is stored
//   - in place, if the value belongs to this entity alone;
//   - as a new property of the instance, if the value is a macro's;
//   - in the macro, if the entity is a child made by the macro and all such children agree.
// Populations are replaced by individual models, because their members may have moved.

#include <algorithm>
#include <cerrno>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "files/whole_file.hh"
#include "messages/report.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg {
namespace worldfile {
namespace {

struct Edit {
  std::size_t offset;
  std::size_t length;
  std::string text;
};

// True if a value in the file has changed.
bool Differs(std::string_view old, const std::string& now) {
  if (old == now) return false;
  const ReadNumber before = ReadFloatText(old), after = ReadFloatText(now);
  return !(before.clean && after.clean && before.value == after.value);
}

// Collects the edits to the text of the world file.
class SaveEdits {
 public:
  SaveEdits(Document& document, const std::vector<Population>& populations,
            const std::map<Slot, Written>& written)
      : document_(document), populations_(populations), written_(written) {}

  std::string Text();

 private:
  struct Shared {  // new values of a property of a child made by a macro
    std::size_t entities = 0;
    std::uint32_t entity = 0;
    std::uint32_t property = 0;
    bool changed = false;
    bool agreed = true;
    Written values;
  };

  void RecordPopulation(const Population& population);
  std::string MemberText(const std::string& model, std::uint32_t member) const;
  void Record(const Slot& slot, const Written& values);
  void RecordShared(const Slot& slot, std::uint32_t property, const Written& values);
  void FinishShared();
  void Replace(std::uint32_t property, const Written& values);
  void Insert(std::uint32_t body, std::uint32_t property, const Written& values);
  bool Changed(std::uint32_t property, const Written& values) const;
  const Token& ValueToken(std::uint32_t property, std::size_t index) const;
  std::string NewToken(const Token& token, const std::string& text) const;
  std::string PropertyText(std::uint32_t property, const Written& values) const;
  std::string Apply();

  Document& document_;
  const std::vector<Population>& populations_;
  const std::map<Slot, Written>& written_;
  std::map<Slot, Shared> shared_;  // by body and name
  std::vector<Edit> edits_;
};

std::string SaveEdits::Text() {
  std::set<std::uint32_t> members;
  for (const Population& population : populations_) {
    RecordPopulation(population);
    members.insert(population.members.begin(), population.members.end());
  }
  for (const auto& [slot, values] : written_) {
    if (members.count(slot.first) == 0) Record(slot, values);
  }
  FinishShared();
  for (const DroppedText& dropped : document_.dropped) {
    edits_.push_back({dropped.offset, dropped.length, ""});
  }
  return Apply();
}

// Replaces the section by its members.
void SaveEdits::RecordPopulation(const Population& population) {
  if (population.entity < 0) {
    document_.Warn(document_.tokens[0], "populations made by --set are not saved");
    return;
  }
  const Entity& section = document_.entities[static_cast<std::size_t>(population.entity)];
  const Token& begin = document_.tokens[section.name_token];
  const std::uint32_t close = document_.bodies[section.body].close_token;
  if (begin.source != 0 || close == kNone) {
    document_.Warn(begin, "population " + Quoted(population.name) +
                              " is not saved as it is: it belongs to a file that is included");
    return;
  }
  const std::uint32_t model = document_.Find(static_cast<std::uint32_t>(population.entity),
                                             document_.names.Intern("model"));
  std::string text;
  for (const int member : population.members)
    text +=
        (text.empty() ? "" : "\n") + MemberText(std::string(document_.Text(ValueToken(model, 0))),
                                                static_cast<std::uint32_t>(member));
  edits_.push_back({begin.offset, document_.tokens[close].offset + 1 - begin.offset, text});
}

std::string SaveEdits::MemberText(const std::string& model, std::uint32_t member) const {
  const Property& name = document_.properties[document_.Find(member, document_.name_of_models)];
  std::string text =
      model + "( name \"" + std::string(document_.Text(document_.tokens[name.first_value])) + "\"";
  for (auto slot = written_.lower_bound({member, 0});
       slot != written_.end() && slot->first.first == member; ++slot) {
    if (slot->first.second == document_.name_of_models) continue;
    const std::uint32_t property = document_.Find(member, slot->first.second);
    if (Changed(property, slot->second)) text += " " + PropertyText(property, slot->second);
  }
  return text + " )";
}

void SaveEdits::Record(const Slot& slot, const Written& values) {
  const std::uint32_t property = document_.Find(slot.first, slot.second);
  const std::uint32_t body = document_.entities[slot.first].body;
  if (document_.bodies[body].in_macro) {
    RecordShared(slot, property, values);
  } else if (document_.FindIn(body, slot.second) == property) {
    Replace(property, values);
  } else if (Changed(property, values)) {
    Insert(body, property, values);
  }
}

void SaveEdits::RecordShared(const Slot& slot, std::uint32_t property, const Written& values) {
  Shared& shared = shared_[{document_.entities[slot.first].body, slot.second}];
  if (shared.entities++ == 0) {
    shared.values = values;
    shared.property = property;
    shared.entity = slot.first;
  }
  shared.agreed = shared.agreed && shared.values == values && shared.property == property;
  shared.changed = shared.changed || Changed(property, values);
}

void SaveEdits::FinishShared() {
  std::vector<std::size_t> users(document_.bodies.size());
  for (const Entity& entity : document_.entities) ++users[entity.body];
  for (const auto& [slot, shared] : shared_) {
    if (!shared.changed) continue;
    if (!shared.agreed || shared.entities != users[slot.first]) {
      const Token& at = document_.tokens[document_.properties[shared.property].name_token];
      document_.Warn(at, "property " + Quoted(document_.names.Text(slot.second)) +
                             " is not saved: its entity belongs to a macro, whose instances have "
                             "different values");
    } else if (document_.FindIn(slot.first, slot.second) == shared.property) {
      Replace(shared.property, shared.values);
    } else {
      Insert(slot.first, shared.property, shared.values);
    }
  }
}

const Token& SaveEdits::ValueToken(std::uint32_t property, std::size_t index) const {
  return document_.tokens[document_.properties[property].first_value + index];
}

bool SaveEdits::Changed(std::uint32_t property, const Written& values) const {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (values[i] && Differs(document_.Text(ValueToken(property, i)), *values[i])) return true;
  return false;
}

std::string SaveEdits::NewToken(const Token& token, const std::string& text) const {
  const bool quotes = token.kind == TokenKind::kString || !IsNumberToken(text);
  return quotes ? "\"" + text + "\"" : text;
}

// Replaces values, except in included files. Numbers with equal values keep their text.
void SaveEdits::Replace(std::uint32_t property, const Written& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Token& token = ValueToken(property, i);
    if (values[i] && token.source == 0 && Differs(document_.Text(token), *values[i])) {
      edits_.push_back({token.offset, token.length, NewToken(token, *values[i])});
    }
  }
}

// Adds a property before the closing parenthesis of a body; on a separate line if the parenthesis
// is on one.
void SaveEdits::Insert(std::uint32_t body, std::uint32_t property, const Written& values) {
  if (document_.bodies[body].close_token == kNone) return;
  const Token& close = document_.tokens[document_.bodies[body].close_token];
  if (close.source != 0) return;
  const std::string_view text = document_.sources.Text(0);
  std::size_t line = close.offset;
  while (line > 0 && (text[line - 1] == ' ' || text[line - 1] == '\t')) --line;
  const bool own_line = line > 0 && (text[line - 1] == '\n' || text[line - 1] == '\r');
  const std::string indent(text.substr(line, close.offset - line));
  const std::string added = PropertyText(property, values);
  edits_.push_back({close.offset, 0, own_line ? "  " + added + "\n" + indent : " " + added + " "});
}

std::string SaveEdits::PropertyText(std::uint32_t property, const Written& values) const {
  const Property& from = document_.properties[property];
  // Keeps brackets around a single value.
  const bool tuple = document_.tokens[from.first_value - 1].kind == TokenKind::kOpenBracket;
  std::string text = document_.names.Text(from.name) + (tuple ? " [" : " ");
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Token& token = ValueToken(property, i);
    if (i > 0) text += " ";
    text += NewToken(token, values[i] ? *values[i] : std::string(document_.Text(token)));
  }
  return tuple ? text + "]" : text;
}

std::string SaveEdits::Apply() {
  std::stable_sort(edits_.begin(), edits_.end(),
                   [](const Edit& a, const Edit& b) { return a.offset < b.offset; });
  const std::string_view text = document_.sources.Text(0);
  std::string result;
  std::size_t at = 0;
  const auto copy_until = [&](std::size_t end) {
    while (at < end) {
      const std::size_t line_end = LineEndLength(text, at);
      result += line_end > 0 ? '\n' : text[at];
      at += std::max<std::size_t>(line_end, 1);
    }
  };
  for (const Edit& edit : edits_) {
    copy_until(edit.offset);
    result += edit.text;
    at = std::max(at, edit.offset + edit.length);
  }
  copy_until(text.size());
  return result;
}

}  // namespace

std::string SavedText(Document& document, const std::vector<Population>& populations,
                      const std::map<Slot, Written>& written) {
  return SaveEdits(document, populations, written).Text();
}

}  // namespace worldfile

bool Worldfile::Save(const std::string& file) {
  const std::string name = file.empty() ? filename : file;
  int error = ENOENT;
  if (!name.empty() && impl_->document.sources.Count() > 0) {
    error = files::ReplaceFile(
        name, worldfile::SavedText(impl_->document, impl_->populations, impl_->written),
        files::AnyFile);
  }
  if (error == 0) return true;
  messages::Report(LogLevel::kError, "unable to save world file " +
                                         messages::Shortened(name, messages::kMaxDetailBytes) +
                                         " : " + std::generic_category().message(error));
  return false;
}

}  // namespace Stg
