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

}  // namespace Stg::recording

#endif
