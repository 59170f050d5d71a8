// SPDX-License-Identifier: GPL-2.0-or-later
// Reads JPEG pictures with libjpeg or libjpeg-turbo.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "pictures/picture_reader.hh"
#ifdef STAGE_HAVE_JPEG
#include <jerror.h>
#include <jpeglib.h>

#include <csetjmp>
#endif

namespace Stg {
namespace picture {

#ifdef STAGE_HAVE_JPEG
namespace {

// libjpeg reports errors by a callback that must not return, so it uses longjmp(). All calls that
// can fail go through Guarded(); a jump must not skip destructors.
class JpegReader {
 public:
  explicit JpegReader(const Input& input) : input_(input) {
    jpeg_.err = jpeg_std_error(&errors_);
    jpeg_.client_data = this;
    errors_.error_exit = OnError;
    errors_.emit_message = OnMessage;
    progress_.progress_monitor = OnProgress;
    Guarded([this] { jpeg_create_decompress(&jpeg_); });
  }
  ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  Bitmap Read() {
    Guarded([this] {
      jpeg_.progress = &progress_;
      jpeg_stdio_src(&jpeg_, input_.file);
      jpeg_read_header(&jpeg_, TRUE);
    });
    Bitmap bitmap = MakeBitmapOfHeader();
    SetConversions();
    Guarded([this] { jpeg_start_decompress(&jpeg_); });
    row_.resize(std::size_t{jpeg_.output_width} *
                static_cast<std::size_t>(jpeg_.output_components));
    while (jpeg_.output_scanline < jpeg_.output_height) ReadRow(&bitmap);
    Guarded([this] { jpeg_finish_decompress(&jpeg_); });
    return bitmap;
  }

 private:
  template <class Step>
  void Guarded(Step step) {
    if (setjmp(jump_) != 0) Fail(input_, std::string("unreadable JPEG: ") + message_);
    step();
  }

  Bitmap MakeBitmapOfHeader() const {
    const std::uint64_t width = jpeg_.image_width, height = jpeg_.image_height;
    // A progressive picture's coefficients (16 bits) are kept until its last scan has been read.
    const unsigned bits_per_sample = jpeg_.progressive_mode ? 24 : 8;
    // 64 pixels take at least one bit.
    return MakeBitmap(input_, width, height,
                      static_cast<unsigned>(jpeg_.num_components) * bits_per_sample,
                      jpeg_.arith_code ? 0 : width * height / 512);
  }

  // Fixes all options, so that the result does not depend on the version of the library.
  void SetConversions() {
    if (jpeg_.jpeg_color_space == JCS_CMYK || jpeg_.jpeg_color_space == JCS_YCCK)
      Fail(input_, "this is a JPEG picture in CMYK; save it in grey or RGB, or as PNG");
    jpeg_.out_color_space = jpeg_.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_.dct_method = JDCT_ISLOW;
    jpeg_.do_fancy_upsampling = FALSE;
  }

  void ReadRow(Bitmap* bitmap) {
    std::uint64_t* const words = bitmap->Row(jpeg_.output_scanline);
    Guarded([this] {
      JSAMPROW row = row_.data();
      jpeg_read_scanlines(&jpeg_, &row, 1);
    });
    const auto step = static_cast<std::size_t>(jpeg_.output_components);
    for (std::size_t x = 0; x < jpeg_.output_width; ++x)
      words[x / 64] |= std::uint64_t{row_[x * step] <= input_.threshold} << (x % 64);
  }

  static JpegReader* Self(j_common_ptr jpeg) { return static_cast<JpegReader*>(jpeg->client_data); }

  [[noreturn]] static void OnError(j_common_ptr jpeg) {
    JpegReader* const self = Self(jpeg);
    jpeg->err->format_message(jpeg, self->message_);
    std::longjmp(self->jump_, 1);
  }

  // Turns warnings about missing data into errors: libjpeg would fill missing pixels with grey.
  static void OnMessage(j_common_ptr jpeg, int) {
    const int code = jpeg->err->msg_code;
    if (code != JWRN_JPEG_EOF && code != JWRN_HIT_MARKER) return;
    std::snprintf(Self(jpeg)->message_, sizeof message_, "the file is cut short");
    std::longjmp(Self(jpeg)->jump_, 1);
  }

  // Limits the time: a small file may declare thousands of scans of a large picture.
  static void OnProgress(j_common_ptr jpeg) {
    constexpr int kMaxScans = 200;
    const auto* const self = reinterpret_cast<j_decompress_ptr>(jpeg);
    if (self->input_scan_number <= kMaxScans) return;
    std::snprintf(Self(jpeg)->message_, sizeof message_, "found more than %d scans", kMaxScans);
    std::longjmp(Self(jpeg)->jump_, 1);
  }

  const Input& input_;
  jpeg_decompress_struct jpeg_ = {};
  jpeg_error_mgr errors_ = {};
  jpeg_progress_mgr progress_ = {};
  std::jmp_buf jump_;
  char message_[JMSG_LENGTH_MAX] = "";
  std::vector<JSAMPLE> row_;
};

}  // namespace

Bitmap ReadJpeg(const Input& input) { return JpegReader(input).Read(); }
#else
Bitmap ReadJpeg(const Input& input) {
  Fail(input, "this is a JPEG picture, and this Stage was built without libjpeg; save it as PNG");
}
#endif

}  // namespace picture
}  // namespace Stg
