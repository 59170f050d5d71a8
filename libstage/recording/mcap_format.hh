// SPDX-License-Identifier: GPL-2.0-or-later
//
// Constants of the MCAP file format, https://mcap.dev/spec. A record is an opcode, the length of
// the rest in 8 bytes, and its fields.

#ifndef STAGE_RECORDING_MCAP_FORMAT_HH
#define STAGE_RECORDING_MCAP_FORMAT_HH

#include <cstdint>
#include <string_view>

namespace Stg::recording {

/// First and last bytes of a file.
inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);

/// Checksum of MCAP: CRC-32 as in zlib. `before` is that of the preceding bytes.
uint32_t Crc(std::string_view bytes, uint32_t before = 0);

enum class Op : uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd
};

inline constexpr size_t kRecordHead = 9;                             // opcode and length
inline constexpr size_t kMessageHead = kRecordHead + 2 + 4 + 8 + 8;  // before the data
inline constexpr unsigned kMaxChannels = 65535;

// Limits for writing and reading, because a file of a few kilobytes may claim any size. A chunk is
// handed on once it has a megabyte, so only a single message can make it exceed two. The largest
// are the first poses, 40 bytes per model: the limit allows 1.5 million models.
inline constexpr uint64_t kMaxMessageBytes = 60 << 20;      // bytes
inline constexpr uint64_t kMaxChunkBytes = 64 << 20;        // uncompressed
inline constexpr uint64_t kMaxAttachmentBytes = 512 << 20;  // all world files and images together
inline constexpr uint64_t kMaxNameBytes = 64 << 20;         // all metadata, schemas and channels

}  // namespace Stg::recording

#endif
