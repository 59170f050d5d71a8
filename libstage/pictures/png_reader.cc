// SPDX-License-Identifier: GPL-2.0-or-later
#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <new>
#include <type_traits>
#include <vector>

#include "pictures/picture_reader.hh"

namespace Stg {
namespace picture {
namespace {

// libpng reports errors by longjmp(). All calls that can fail go through Guarded(), whose callees
// own nothing with a destructor. It turns the jump into an exception.
class PngReader {
 public:
  explicit PngReader(const Input& input) : input_(input) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, OnError, OnWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, nullptr, nullptr);
      throw std::bad_alloc();
    }
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  Bitmap Read() {
    Guarded([this] { ReadHeader(); });
    Bitmap bitmap = MakeBitmapOfHeader();
    Guarded([this] { SetConversions(); });
    row_.resize(png_get_rowbytes(png_, info_));
    if (input_.samples) MakeSamples(bitmap);
    if (png_get_interlace_type(png_, info_) == PNG_INTERLACE_NONE) {
      for (int y = 0; y < bitmap.height(); ++y) ReadRow(bitmap, static_cast<unsigned>(y), 0, 1);
    } else {
      for (int pass = 0; pass < PNG_INTERLACE_ADAM7_PASSES; ++pass) ReadPass(bitmap, pass);
    }
    Guarded([this] { png_read_end(png_, nullptr); });
    return bitmap;
  }

 private:
  template <class Step>
  void Guarded(Step step) {
    static_assert(std::is_trivially_destructible_v<Step>, "a jump would skip its destructor");
    if (setjmp(png_jmpbuf(png_)) != 0) Fail(input_, std::string("unreadable PNG: ") + message_);
    step();
  }

  void ReadHeader() {
    png_set_read_fn(png_, input_.file, ReadBytes);
    // Our limits are checked later but before allocation, with a better message.
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    // Texts, colour profiles and the like may unpack to a thousand times their size, so all chunks
    // that do not affect the samples are skipped.
    png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
    png_set_chunk_malloc_max(png_, 4000000);
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    png_set_crc_action(png_, PNG_CRC_QUIET_USE, PNG_CRC_QUIET_USE);
#endif
    png_read_info(png_, info_);
  }

  Bitmap MakeBitmapOfHeader() const {
    const std::uint64_t width = png_get_image_width(png_, info_);
    const std::uint64_t height = png_get_image_height(png_, info_);
    const unsigned bits = png_get_channels(png_, info_) * unsigned{png_get_bit_depth(png_, info_)};
    // PNG compresses by a factor of at most 1032. A file that declares far more than it can hold is
    // rejected here, before anything is unpacked.
    const std::uint64_t min_size = width * height / 8 * bits / 1040;
    return MakeBitmap(input_, width, height, bits, min_size);
  }

  void SetConversions() {
    const int colour_type = png_get_color_type(png_, info_);
    if (colour_type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (colour_type == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(png_);
    png_set_strip_16(png_);
    png_read_update_info(png_, info_);
  }

  void MakeSamples(const Bitmap& bitmap) {
    const std::size_t channels = png_get_channels(png_, info_);
    const auto pixels =
        static_cast<std::size_t>(bitmap.width()) * static_cast<std::size_t>(bitmap.height());
    *input_.samples = {bitmap.width(), bitmap.height(), static_cast<int>(channels), {}};
    input_.samples->values.resize(pixels * channels);
  }

  // Reads one of the seven passes of an interlaced picture. libpng could combine them, but only in
  // a buffer for all channels of the picture.
  void ReadPass(Bitmap& bitmap, int pass) {
    const unsigned width = static_cast<unsigned>(bitmap.width());
    const unsigned height = static_cast<unsigned>(bitmap.height());
    if (PNG_PASS_COLS(width, pass) == 0) return;  // the file has no rows for such a pass
    const unsigned rows = PNG_PASS_ROWS(height, pass);
    for (unsigned row = 0; row < rows; ++row) {
      ReadRow(bitmap, PNG_ROW_FROM_PASS_ROW(row, pass), PNG_PASS_START_COL(pass),
              PNG_PASS_COL_OFFSET(pass));
    }
  }

  // Reads a row with the pixels at first_x, first_x + step_x, ...
  void ReadRow(Bitmap& bitmap, std::size_t y, std::size_t first_x, std::size_t step_x) {
    Guarded([this] { png_read_row(png_, row_.data(), nullptr); });
    const std::size_t channels = png_get_channels(png_, info_);
    const std::size_t width = static_cast<std::size_t>(bitmap.width());
    std::uint64_t* const words = bitmap.Row(y);
    const std::uint8_t* from = row_.data();
    for (std::size_t x = first_x; x < width; x += step_x, from += channels) {
      words[x / 64] |= std::uint64_t{*from <= input_.threshold} << (x % 64);
      if (input_.samples)
        std::copy_n(from, channels, &input_.samples->values[(y * width + x) * channels]);
    }
  }

  static void ReadBytes(png_structp png, png_bytep to, std::size_t count) {
    if (std::fread(to, 1, count, static_cast<std::FILE*>(png_get_io_ptr(png))) != count) {
      png_error(png, "the file is cut short");
    }
  }

  [[noreturn]] static void OnError(png_structp png, png_const_charp message) {
    PngReader* const self = static_cast<PngReader*>(png_get_error_ptr(png));
    std::snprintf(self->message_, sizeof self->message_, "%s", message);
    png_longjmp(png, 1);
  }

  static void OnWarning(png_structp, png_const_charp) {}

  const Input& input_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::vector<std::uint8_t> row_;
  char message_[160] = "";
};

}  // namespace

Bitmap ReadPng(const Input& input) { return PngReader(input).Read(); }

}  // namespace picture
}  // namespace Stg
