// SPDX-License-Identifier: GPL-2.0-or-later
#include "geometry/picture.hh"

#include <png.h>

#include <algorithm>
#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <string_view>
#include <type_traits>

#include "geometry/load_error.hh"

namespace Stg {
namespace picture {
namespace {

constexpr std::uint64_t kMaxSide = 32768;                    // pixels
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;  // of all decoded samples
constexpr int kExitStatus = 255;

// A picture file from its first byte on. `size` is its length in bytes.
struct Input {
  std::FILE* file;
  std::uint64_t size;
  const std::string& name;
};

[[noreturn]] void Fail(const Input& input, const std::string& reason) {
  throw LoadError(input.name + ": " + reason, kExitStatus);
}

// An empty raster with room for the picture. Refuses what is too large before memory is taken for
// it. `decoded_bits`: all samples of the file, decoded; `least_size`: a file of this picture cannot
// be smaller. Memory is reserved, not touched: rows are added as they are read.
Raster MakeRaster(const Input& input, std::uint64_t width, std::uint64_t height,
                  std::uint64_t bits_per_pixel, std::uint64_t least_size) {
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (width == 0 || height == 0) Fail(input, "a picture of " + size + " is empty");
  if (width > kMaxSide || height > kMaxSide) {
    Fail(input, "a picture of " + size + " is too large; at most " + std::to_string(kMaxSide) +
                    " pixels a side are accepted");
  }
  if (width * height > kMaxBytes * 8 / bits_per_pixel) {
    Fail(input, "a picture of " + size + " with " + std::to_string(bits_per_pixel) +
                    " bits each is too large; at most 1 GiB is accepted");
  }
  if (input.size < least_size) Fail(input, "the file is cut short");
  Raster raster;
  raster.width = static_cast<int>(width);
  raster.height = static_cast<int>(height);
  raster.samples.reserve(width * height);
  return raster;
}

// The samples of row y, which are made (white) if the raster does not reach that far yet.
std::uint8_t* RowOf(Raster& raster, std::size_t y) {
  const std::size_t width = static_cast<std::size_t>(raster.width);
  if (raster.samples.size() < (y + 1) * width) raster.samples.resize((y + 1) * width, 255);
  return raster.samples.data() + y * width;
}

// ---- PNG

// libpng reports errors by a jump out of its functions. All calls that can fail go through
// Guarded(), whose callees own nothing that would need a destructor; from there on the error is an
// exception.
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

  Raster Read() {
    Guarded([this] { ReadHeader(); });
    Raster raster = MakeRasterOfHeader();
    Guarded([this] { SetConversions(); });
    row_.resize(png_get_rowbytes(png_, info_));
    if (png_get_interlace_type(png_, info_) == PNG_INTERLACE_NONE) {
      for (int y = 0; y < raster.height; ++y) ReadRow(raster, static_cast<unsigned>(y), 0, 1);
    } else {
      for (int pass = 0; pass < PNG_INTERLACE_ADAM7_PASSES; ++pass) ReadPass(raster, pass);
    }
    Guarded([this] { png_read_end(png_, nullptr); });
    return raster;
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
    // Our own limits are checked next, with a better message, before memory is taken.
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    // Texts, colour profiles and the like may unpack to a thousand times their size: pass over all
    // that does not change the samples.
    png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
    png_set_chunk_malloc_max(png_, 4000000);
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    png_set_crc_action(png_, PNG_CRC_QUIET_USE, PNG_CRC_QUIET_USE);
#endif
    png_read_info(png_, info_);
  }

  Raster MakeRasterOfHeader() const {
    const std::uint64_t width = png_get_image_width(png_, info_);
    const std::uint64_t height = png_get_image_height(png_, info_);
    const unsigned bits = png_get_channels(png_, info_) * unsigned{png_get_bit_depth(png_, info_)};
    // The compression of PNG saves at most a factor of 1032; a file that declares far more than it
    // can hold is refused here, before any of it is unpacked.
    const std::uint64_t least_size = width * height / 8 * bits / 1040;
    return MakeRaster(input_, width, height, bits, least_size);
  }

  void SetConversions() {
    const int colour_type = png_get_color_type(png_, info_);
    if (colour_type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (colour_type == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(png_);
    png_set_strip_16(png_);
    png_read_update_info(png_, info_);
  }

  // One of the seven reduced pictures that make up an interlaced one. libpng could put them
  // together as well, but only if it is given memory for all channels of the picture.
  void ReadPass(Raster& raster, int pass) {
    const unsigned width = static_cast<unsigned>(raster.width);
    const unsigned height = static_cast<unsigned>(raster.height);
    if (PNG_PASS_COLS(width, pass) == 0) return;  // such a pass has no rows in the file
    const unsigned rows = PNG_PASS_ROWS(height, pass);
    for (unsigned row = 0; row < rows; ++row) {
      ReadRow(raster, PNG_ROW_FROM_PASS_ROW(row, pass), PNG_PASS_START_COL(pass),
              PNG_PASS_COL_OFFSET(pass));
    }
  }

  // Reads a row and stores the first sample of its pixels at first_x, first_x + step_x, ...
  void ReadRow(Raster& raster, std::size_t y, std::size_t first_x, std::size_t step_x) {
    Guarded([this] { png_read_row(png_, row_.data(), nullptr); });
    const std::size_t channels = png_get_channels(png_, info_);
    const std::size_t width = static_cast<std::size_t>(raster.width);
    std::uint8_t* const samples = RowOf(raster, y);
    const std::uint8_t* from = row_.data();
    for (std::size_t x = first_x; x < width; x += step_x, from += channels) samples[x] = *from;
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

// ---- PBM, PGM, PPM

class PnmReader {
 public:
  explicit PnmReader(const Input& input) : input_(input) {}

  Raster Read() {
    GetByte();  // the letter P
    const int kind = GetByte() - '0';
    plain_ = kind <= 3;
    bitmap_ = kind == 1 || kind == 4;
    channels_ = kind == 3 || kind == 6 ? 3 : 1;
    const unsigned width = ReadNumber("the width");
    const unsigned height = ReadNumber("the height");
    if (!bitmap_) largest_ = ReadNumber("the largest sample");
    if (largest_ == 0 || largest_ > 65535) Fail(input_, "the largest sample is not 1 to 65535");
    if (!plain_) SkipSeparator();

    const std::uint64_t bits = bitmap_ ? 1 : channels_ * (largest_ > 255 ? 16 : 8);
    row_.resize(plain_ || width > kMaxSide ? 0 : (width * bits + 7) / 8);
    const std::uint64_t row_bytes = plain_ ? std::uint64_t{width} * channels_ : row_.size();
    Raster raster = MakeRaster(input_, width, height, bits, row_bytes * height);
    for (unsigned y = 0; y < height; ++y) ReadRow(RowOf(raster, y), width);
    return raster;
  }

 private:
  void ReadRow(std::uint8_t* samples, std::size_t width) {
    if (!plain_ && std::fread(row_.data(), 1, row_.size(), input_.file) != row_.size()) {
      Fail(input_, "the file is cut short");
    }
    for (std::size_t x = 0; x < width; ++x) {
      if (bitmap_) {
        const bool black = plain_ ? ReadBit() : (row_[x / 8] >> (7 - x % 8) & 1) != 0;
        samples[x] = black ? 0 : 255;
      } else {
        samples[x] = To8Bits(plain_ ? ReadPlainPixel() : RawPixel(x));
      }
    }
  }

  unsigned RawPixel(std::size_t x) const {
    if (largest_ <= 255) return row_[x * channels_];
    const std::size_t at = 2 * x * channels_;
    return unsigned{row_[at]} << 8 | row_[at + 1];
  }

  unsigned ReadPlainPixel() {
    const unsigned first = ReadNumber("a sample");
    for (unsigned others = 1; others < channels_; ++others) ReadNumber("a sample");
    return first;
  }

  // The digits of a plain bitmap need nothing between them.
  bool ReadBit() {
    const int byte = SkipBlanks();
    if (byte != '0' && byte != '1') FailAt(byte, "0 or 1");
    return byte == '1';
  }

  std::uint8_t To8Bits(unsigned sample) const {
    if (sample > largest_) {
      Fail(input_, "sample " + std::to_string(sample) + " is above the largest one declared, " +
                       std::to_string(largest_));
    }
    // True 16-bit samples are cut to their high byte, as they are in a PNG.
    return static_cast<std::uint8_t>(largest_ == 65535 ? sample >> 8 : sample * 255 / largest_);
  }

  // Skips white space and comments; the byte after them is taken.
  int SkipBlanks() {
    for (;;) {
      const int byte = GetByte();
      if (byte == '#') {
        SkipLine();
      } else if (!IsBlank(byte)) {
        return byte;
      }
    }
  }

  void SkipLine() {
    for (int byte = GetByte(); byte != '\n' && byte != EOF;) byte = GetByte();
  }

  // Raw samples start after the one blank, or the comment, that ends the header.
  void SkipSeparator() {
    const int byte = GetByte();
    if (byte == '#') {
      SkipLine();
    } else if (!IsBlank(byte)) {
      FailAt(byte, "a blank");
    }
  }

  unsigned ReadNumber(const char* what) {
    int byte = SkipBlanks();
    if (byte < '0' || byte > '9') FailAt(byte, what);
    unsigned value = 0;
    for (; byte >= '0' && byte <= '9'; byte = GetByte()) {
      if (value > 99999999) Fail(input_, std::string(what) + " is too large a number");
      value = value * 10 + static_cast<unsigned>(byte - '0');
    }
    std::ungetc(byte, input_.file);
    return value;
  }

  [[noreturn]] void FailAt(int byte, const std::string& expected) const {
    if (byte == EOF) Fail(input_, "the file is cut short");
    char found[16];
    std::snprintf(found, sizeof found, byte > ' ' && byte < 127 ? "'%c'" : "byte 0x%02x", byte);
    Fail(input_, std::string(found) + " found, " + expected + " expected");
  }

  int GetByte() { return getc_unlocked(input_.file); }
  static bool IsBlank(int byte) { return byte == ' ' || (byte >= '\t' && byte <= '\r'); }

  const Input& input_;
  bool plain_ = false;   // samples are written as decimal numbers
  bool bitmap_ = false;  // samples are bits, 1 is black
  unsigned channels_ = 1;
  unsigned largest_ = 1;
  std::vector<std::uint8_t> row_;
};

// ---- which format

bool IsPnm(std::string_view head) {
  return head.size() > 2 && head[0] == 'P' && head[1] >= '1' && head[1] <= '6' &&
         std::string_view(" \t\n\v\f\r#").find(head[2]) != std::string_view::npos;
}

// What a file that is not accepted seems to be.
std::string KindOf(std::string_view head) {
  static constexpr struct {
    std::string_view start;
    const char* kind;
  } kKinds[] = {{"\xff\xd8\xff", "a JPEG picture"},
                {"GIF8", "a GIF picture"},
                {"BM", "a BMP picture"},
                {"/* XPM", "an XPM picture"},
                {"#define", "an XBM picture"},
                {{"II*\0", 4}, "a TIFF picture"},
                {{"MM\0*", 4}, "a TIFF picture"},
                {"P7", "a PAM picture"},
                {"<svg", "an SVG picture"},
                {"%PDF", "a PDF document"},
                {"\x89PN", "a damaged PNG picture"}};
  for (const auto& known : kKinds) {
    if (head.starts_with(known.start)) return known.kind;
  }
  if (head.starts_with("RIFF") && head.substr(0, 12).ends_with("WEBP")) return "a WebP picture";
  return "not a picture of a known kind";
}

Raster Read(const Input& input) try {
  char start[12];
  const std::string_view head(start, std::fread(start, 1, sizeof start, input.file));
  std::rewind(input.file);
  if (head.empty()) Fail(input, "the file is empty");
  if (head.starts_with("\x89PNG\r\n\x1a\n")) return PngReader(input).Read();
  if (IsPnm(head)) return PnmReader(input).Read();
  Fail(input, "this is " + KindOf(head) + "; accepted are PNG, PBM, PGM and PPM");
} catch (const std::bad_alloc&) {
  Fail(input, "not enough memory for the picture");
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace

Raster Load(const std::string& path) {
  Input input{nullptr, 0, path};
  // Asked before opening, which would wait for ever at a pipe.
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) Fail(input, "this is a directory, not a picture");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    Fail(input, "this is not a regular file");
  }
  const File file(std::fopen(path.c_str(), "rb"));
  if (file == nullptr) Fail(input, std::string("cannot open the picture: ") + std::strerror(errno));
  input.file = file.get();
  input.size = std::filesystem::file_size(path, error);
  if (error) Fail(input, "cannot read the picture: " + error.message());
  return Read(input);
}

Raster LoadFromMemory(const void* data, std::size_t size, const std::string& name) {
  Input input{nullptr, size, name};
  if (size == 0) Fail(input, "the file is empty");
  const File file(fmemopen(const_cast<void*>(data), size, "rb"));  // only read, as "rb" says
  if (file == nullptr) Fail(input, std::string("cannot read the picture: ") + std::strerror(errno));
  input.file = file.get();
  return Read(input);
}

}  // namespace picture
}  // namespace Stg
