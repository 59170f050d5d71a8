// SPDX-License-Identifier: GPL-2.0-or-later
// Reads GIF pictures with giflib. Of an animation, only the first picture is read.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "pictures/picture_reader.hh"
#ifdef STAGE_HAVE_GIF
#include <gif_lib.h>
#endif

namespace Stg {
namespace picture {

#ifdef STAGE_HAVE_GIF
namespace {

class GifReader {
 public:
  explicit GifReader(const Input& input) : input_(input) {
    int error = 0;
    gif_ = DGifOpen(input.file, ReadBytes, &error);
    if (gif_ == nullptr) FailWith(error);
  }
  ~GifReader() { DGifCloseFile(gif_, nullptr); }
  GifReader(const GifReader&) = delete;
  GifReader& operator=(const GifReader&) = delete;

  Bitmap Read() {
    FindPicture();
    Check(DGifGetImageDesc(gif_));
    const GifImageDesc& picture = gif_->Image;
    const std::uint64_t width = static_cast<unsigned>(gif_->SWidth);
    const std::uint64_t height = static_cast<unsigned>(gif_->SHeight);
    // A 12-bit code stands for at most 3838 equal pixels.
    Bitmap bitmap = MakeBitmap(input_, width, height, 8, width * height / 2700);
    if (picture.Left < 0 || picture.Top < 0 || picture.Width < 1 || picture.Height < 1 ||
        picture.Left + picture.Width > gif_->SWidth || picture.Top + picture.Height > gif_->SHeight)
      Fail(input_, "damaged GIF: found a picture that reaches beyond its frame");
    ReadPalette(picture.ColorMap != nullptr ? picture.ColorMap : gif_->SColorMap);
    row_.resize(static_cast<std::size_t>(picture.Width));
    if (picture.Interlace) {
      constexpr struct { int first, step; } kPasses[] = {{0, 8}, {4, 8}, {2, 4}, {1, 2}};
      for (const auto& pass : kPasses)
        for (int y = pass.first; y < picture.Height; y += pass.step) ReadRow(y, &bitmap);
    } else {
      for (int y = 0; y < picture.Height; ++y) ReadRow(y, &bitmap);
    }
    return bitmap;
  }

 private:
  // Skips extensions before the first picture: comments, times, transparency.
  void FindPicture() {
    for (;;) {
      GifRecordType type = UNDEFINED_RECORD_TYPE;
      Check(DGifGetRecordType(gif_, &type));
      if (type == IMAGE_DESC_RECORD_TYPE) return;
      if (type != EXTENSION_RECORD_TYPE) Fail(input_, "damaged GIF: found no picture in it");
      int code = 0;
      GifByteType* block = nullptr;
      Check(DGifGetExtension(gif_, &code, &block));
      while (block != nullptr) Check(DGifGetExtensionNext(gif_, &block));
    }
  }

  void ReadPalette(const ColorMapObject* colors) {
    if (colors == nullptr) Fail(input_, "damaged GIF: found no palette");
    for (int i = 0; i < colors->ColorCount && i < 256; ++i)
      is_solid_[i] = colors->Colors[i].Red <= input_.threshold;
  }

  void ReadRow(int y, Bitmap* bitmap) {
    const GifImageDesc& picture = gif_->Image;
    Check(DGifGetLine(gif_, row_.data(), picture.Width));
    std::uint64_t* const words = bitmap->Row(static_cast<std::size_t>(picture.Top + y));
    for (std::size_t i = 0; i < row_.size(); ++i) {
      const std::size_t x = static_cast<std::size_t>(picture.Left) + i;
      words[x / 64] |= std::uint64_t{is_solid_[row_[i]]} << (x % 64);
    }
  }

  static int ReadBytes(GifFileType* gif, GifByteType* to, int count) {
    return static_cast<int>(
        std::fread(to, 1, static_cast<std::size_t>(count), static_cast<std::FILE*>(gif->UserData)));
  }

  void Check(int result) const {
    if (result != GIF_OK) FailWith(gif_->Error);
  }
  [[noreturn]] void FailWith(int error) const {
    const char* const reason = GifErrorString(error);
    Fail(input_, std::string("unreadable GIF: ") + (reason ? reason : "the file is damaged"));
  }

  const Input& input_;
  GifFileType* gif_ = nullptr;
  bool is_solid_[256] = {};
  std::vector<GifPixelType> row_;
};

}  // namespace

Bitmap ReadGif(const Input& input) { return GifReader(input).Read(); }
#else
Bitmap ReadGif(const Input& input) {
  Fail(input, "this is a GIF picture, and this Stage was built without giflib; save it as PNG");
}
#endif

}  // namespace picture
}  // namespace Stg
