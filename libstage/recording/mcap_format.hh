// SPDX-License-Identifier: GPL-2.0-or-later
//
// What MCAP files consist of: https://mcap.dev/spec. A record is its opcode, the length of what
// follows in 8 bytes, and its fields.

#ifndef STAGE_RECORDING_MCAP_FORMAT_HH
#define STAGE_RECORDING_MCAP_FORMAT_HH

#include <cstdint>
#include <string_view>

namespace Stg::recording {

/// At the beginning and at the end.
inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);

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
inline constexpr size_t kMessageHead = kRecordHead + 2 + 4 + 8 + 8;  // before its data
inline constexpr unsigned kMostChannels = 65535;

// Limits of what is written, and so of what is read: a file of some kilobytes may claim anything.
// A chunk is handed on once it has a megabyte, so only a single message makes it larger than two:
// the first poses, which take 40 bytes for each model; those of 1.5 million models have room.
inline constexpr uint64_t kLargestMessage = 60 << 20;      // bytes
inline constexpr uint64_t kLargestChunk = 64 << 20;        // unpacked
inline constexpr uint64_t kLargestAttachment = 512 << 20;  // all world files and pictures together
inline constexpr uint64_t kLargestNames = 64 << 20;        // all metadata, schemas and channels

}  // namespace Stg::recording

#endif
