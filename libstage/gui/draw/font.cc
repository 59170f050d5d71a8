// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/font.hh"

#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace Stg::draw {

struct Font::Impl {
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  std::unordered_map<uint32_t, Glyph> glyphs;

  ~Impl() {
    if (face) FT_Done_Face(face);
    if (library) FT_Done_FreeType(library);
  }
};

namespace {

/// Returns the file of the system's sans-serif font, or an empty string if there is none.
std::string FindFontFile(int* index) {
  FcConfig* config = FcInitLoadConfigAndFonts();
  FcPattern* wanted = FcNameParse(reinterpret_cast<const FcChar8*>("Helvetica,DejaVu Sans,sans"));
  FcConfigSubstitute(config, wanted, FcMatchPattern);
  FcDefaultSubstitute(wanted);
  FcResult result;
  std::string file;
  if (FcPattern* found = FcFontMatch(config, wanted, &result)) {
    FcChar8* name = nullptr;
    if (FcPatternGetString(found, FC_FILE, 0, &name) == FcResultMatch)
      file = reinterpret_cast<const char*>(name);
    if (FcPatternGetInteger(found, FC_INDEX, 0, index) != FcResultMatch) *index = 0;
    FcPatternDestroy(found);
  }
  FcPatternDestroy(wanted);
  FcConfigDestroy(config);
  return file;
}

/// Decodes the next UTF-8 character. A byte that is not valid UTF-8 stands for itself.
uint32_t NextCode(std::string_view text, size_t* at) {
  const auto byte = [&](size_t i) {
    return i < text.size() ? static_cast<uint8_t>(text[i]) : uint8_t{0};
  };
  const uint32_t first = byte(*at);
  const size_t more = first >= 0xf0 ? 3 : first >= 0xe0 ? 2 : first >= 0xc0 ? 1 : 0;
  uint32_t code = more == 0 ? first : first & (0x3fu >> more);
  for (size_t i = 1; i <= more; i++) {
    if ((byte(*at + i) & 0xc0) != 0x80) {
      (*at)++;
      return first;
    }
    code = code << 6 | (byte(*at + i) & 0x3fu);
  }
  *at += more + 1;
  return code;
}

}  // namespace

Font::Font() = default;
Font::~Font() = default;

bool Font::Open(int pixels, std::string* error) {
  int index = 0;
  const std::string file = FindFontFile(&index);
  if (file.empty()) {
    *error = "no font is installed; install one, such as fonts-dejavu-core, to see texts";
    return false;
  }
  auto impl = std::make_unique<Impl>();
  if (FT_Init_FreeType(&impl->library) != 0 ||
      FT_New_Face(impl->library, file.c_str(), index, &impl->face) != 0 ||
      FT_Set_Pixel_Sizes(impl->face, 0, static_cast<FT_UInt>(pixels)) != 0) {
    *error = "the font " + file + " can't be read; texts are left out";
    return false;
  }
  height_ = static_cast<double>(impl->face->size->metrics.height) / 64;
  descent_ = -static_cast<double>(impl->face->size->metrics.descender) / 64;
  impl_ = std::move(impl);
  atlas_.assign(size_t{kAtlasSide} * kAtlasSide, 0);
  return true;
}

const Font::Glyph& Font::Find(uint32_t code) {
  const auto found = impl_->glyphs.find(code);
  if (found != impl_->glyphs.end()) return found->second;
  return impl_->glyphs[code] = Render(code);
}

/// A glyph that no longer fits into the atlas is drawn as a gap.
Font::Glyph Font::Render(uint32_t code) {
  Glyph glyph;
  if (FT_Load_Char(impl_->face, code, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT) != 0) return glyph;
  const FT_GlyphSlot slot = impl_->face->glyph;
  glyph.advance = static_cast<float>(slot->advance.x) / 64;
  const int width = static_cast<int>(slot->bitmap.width),
            rows = static_cast<int>(slot->bitmap.rows);
  if (next_x_ + width + 1 > kAtlasSide) {
    next_x_ = 1;
    next_y_ += row_height_ + 1;
    row_height_ = 0;
  }
  if (next_y_ + rows + 1 > kAtlasSide || width + 2 > kAtlasSide) return glyph;
  for (int row = 0; row < rows; row++)
    std::copy_n(slot->bitmap.buffer + row * slot->bitmap.pitch, width,
                atlas_.begin() + (next_y_ + row) * kAtlasSide + next_x_);
  glyph.left = static_cast<float>(slot->bitmap_left);
  glyph.bottom = static_cast<float>(slot->bitmap_top - rows);
  glyph.width = static_cast<float>(width);
  glyph.height = static_cast<float>(rows);
  glyph.u = static_cast<float>(next_x_);
  glyph.v = static_cast<float>(next_y_);
  next_x_ += width + 1;
  row_height_ = std::max(row_height_, rows);
  atlas_version_++;
  return glyph;
}

double Font::Width(std::string_view utf8) {
  if (!impl_) return 0;
  double width = 0;
  for (size_t i = 0; i < utf8.size();) width += double{Find(NextCode(utf8, &i)).advance};
  return width;
}

void Font::Append(std::string_view utf8, double x, double y, const Rgba& color,
                  std::vector<TextVertex>* vertices) {
  if (!impl_) return;
  auto pen = static_cast<float>(std::round(x));
  const auto base = static_cast<float>(std::round(y));
  constexpr float kSide = kAtlasSide;
  for (size_t i = 0; i < utf8.size();) {
    const Glyph& g = Find(NextCode(utf8, &i));
    const float x0 = std::round(pen) + g.left, x1 = x0 + g.width;
    const float y0 = base + g.bottom, y1 = y0 + g.height;
    const float u0 = g.u / kSide, u1 = (g.u + g.width) / kSide;
    const float v0 = (g.v + g.height) / kSide, v1 = g.v / kSide;
    for (const TextVertex& vertex :
         {TextVertex{x0, y0, u0, v0, color}, TextVertex{x1, y0, u1, v0, color},
          TextVertex{x1, y1, u1, v1, color}, TextVertex{x0, y0, u0, v0, color},
          TextVertex{x1, y1, u1, v1, color}, TextVertex{x0, y1, u0, v1, color}})
      vertices->push_back(vertex);
    pen += g.advance;
  }
}

}  // namespace Stg::draw
