// SPDX-License-Identifier: GPL-2.0-or-later
#include "pictures/picture.hh"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <string_view>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "pictures/picture_reader.hh"

namespace Stg {
namespace picture {

void Fail(const Input& input, const std::string& reason) {
  constexpr int kExitStatus = 255;
  throw LoadError(messages::Shortened(input.name, messages::kMaxDetailBytes) + ": " + reason,
                  kExitStatus);
}

Bitmap MakeBitmap(const Input& input, std::uint64_t width, std::uint64_t height,
                  std::uint64_t bits_per_pixel, std::uint64_t min_size) {
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  const auto refuse = [&](std::uint64_t limit, const char* of_what) {
    Fail(input, "a picture of " + size + " is too large; at most " + std::to_string(limit) +
                    of_what + " are accepted");
  };
  if (width == 0 || height == 0) Fail(input, "a picture of " + size + " is empty");
  if (width > kMaxSide || height > kMaxSide) refuse(kMaxSide, " pixels a side");
  if (width * height > kMaxPixels) refuse(kMaxPixels, " pixels");
  if (width * height > kMaxSampleBytes * 8 / bits_per_pixel) {
    Fail(input, "a picture of " + size + " with " + std::to_string(bits_per_pixel) +
                    " bits each is too large; at most " + std::to_string(kMaxSampleBytes) +
                    " bytes are accepted; a grey or black-and-white picture needs fewer bits");
  }
  if (input.size < min_size) Fail(input, "the file is cut short");
  return Bitmap(static_cast<int>(width), static_cast<int>(height));
}

namespace {

bool IsPnm(std::string_view head) {
  return head.size() > 2 && head[0] == 'P' && head[1] >= '1' && head[1] <= '6' &&
         std::string_view(" \t\n\v\f\r#").find(head[2]) != std::string_view::npos;
}

// Names the likely format of a file that is not accepted.
std::string KindOf(std::string_view head) {
  static constexpr struct {
    std::string_view start;
    const char* kind;
  } kKinds[] = {{"/* XPM", "an XPM picture"},     {"#define", "an XBM picture"},
                {{"II*\0", 4}, "a TIFF picture"}, {{"MM\0*", 4}, "a TIFF picture"},
                {"P7", "a PAM picture"},          {"<svg", "an SVG picture"},
                {"%PDF", "a PDF document"},       {"\x89PN", "a damaged PNG picture"}};
  for (const auto& known : kKinds) {
    if (head.starts_with(known.start)) return known.kind;
  }
  if (head.starts_with("RIFF") && head.substr(0, 12).ends_with("WEBP")) return "a WebP picture";
  return "not a picture of a known kind";
}

Bitmap Read(const Input& input) try {
  char start[12];
  const std::string_view head(start, std::fread(start, 1, sizeof start, input.file));
  std::rewind(input.file);
  if (head.empty()) Fail(input, "the file is empty");
  if (head.starts_with("\x89PNG\r\n\x1a\n")) return ReadPng(input);
  if (IsPnm(head)) return ReadPnm(input);
  if (head.starts_with("\xff\xd8\xff")) return ReadJpeg(input);
  if (head.starts_with("GIF8")) return ReadGif(input);
  if (head.starts_with("BM")) return ReadBmp(input);
  Fail(input, "this is " + KindOf(head) +
                  "; accepted are PNG, JPEG, GIF, BMP, PBM, PGM and PPM: save it as one of these");
} catch (const std::bad_alloc&) {
  Fail(input, "not enough memory for the picture");
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

Bitmap LoadFile(const std::string& path, std::uint8_t threshold, Samples* samples) {
  Input input{nullptr, 0, path, threshold, samples};
  // Checked before opening, because opening a pipe could block forever.
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
  if (input.size > kMaxFileBytes) {
    Fail(input, "the file has " + std::to_string(input.size) + " bytes; at most " +
                    std::to_string(kMaxFileBytes) + " are accepted");
  }
  return Read(input);
}

}  // namespace

Bitmap Load(const std::string& path, std::uint8_t threshold) {
  return LoadFile(path, threshold, nullptr);
}

namespace {

Bitmap LoadMemory(const void* data, std::size_t size, const std::string& name,
                  std::uint8_t threshold, Samples* samples) {
  Input input{nullptr, size, name, threshold, samples};
  if (size == 0) Fail(input, "the file is empty");
  const File file(fmemopen(const_cast<void*>(data), size, "rb"));  // "rb" never writes to it
  if (file == nullptr) Fail(input, std::string("cannot read the picture: ") + std::strerror(errno));
  input.file = file.get();
  return Read(input);
}

void RequireSamples(const Samples& samples, const std::string& name) {
  if (samples.channels == 0)
    throw LoadError(messages::Shortened(name, messages::kMaxDetailBytes) +
                        ": found a picture of another kind, expected PGM or PNG",
                    255);
}

}  // namespace

Bitmap LoadFromMemory(const void* data, std::size_t size, const std::string& name,
                      std::uint8_t threshold) {
  return LoadMemory(data, size, name, threshold, nullptr);
}

Samples LoadSamples(const std::string& path) {
  Samples samples;
  LoadFile(path, 0, &samples);
  RequireSamples(samples, path);
  return samples;
}

Samples LoadSamplesFromMemory(const void* data, std::size_t size, const std::string& name) {
  Samples samples;
  LoadMemory(data, size, name, 0, &samples);
  RequireSamples(samples, name);
  return samples;
}

}  // namespace picture
}  // namespace Stg
