// SPDX-License-Identifier: GPL-2.0-or-later
//
// The kernels that step rows, by OpenCL and by CUDA: their programs, names and work-items.

#ifndef STAGE_LIBSTAGE_CL_ROW_KERNELS_HH
#define STAGE_LIBSTAGE_CL_ROW_KERNELS_HH

#include <array>
#include <cstdint>

#include "rows/row_backend.hh"

namespace Stg::cl {

/// The programs: row_step.cl, and islands.cl for small and for large islands.
enum RowProgram { kRowProgram, kSmallIslandsProgram, kLargeIslandsProgram, kRowPrograms };

enum RowKernel {
  kStep,
  kBeginOutlines,
  kSolveSmall,
  kSolveLarge,
  kEndOutlines,
  kReset,
  kRestore,
  kGive,
  kGather,
  kCommand,
  kClear,
  kPlace,
  kResetFlagged,
  kRowKernels
};

/// The share of a work-item of a kernel.
enum class RowItem { kPartOfWorld, kEntry, kIslands };

struct RowKernelInfo {
  RowProgram program;
  const char* name;
  RowItem item;
};

inline constexpr std::array<RowKernelInfo, kRowKernels> kRowKernelInfos = {{
    {kRowProgram, "step_rows", RowItem::kPartOfWorld},
    {kRowProgram, "begin_outlines", RowItem::kPartOfWorld},
    {kSmallIslandsProgram, "solve_islands", RowItem::kIslands},
    {kLargeIslandsProgram, "solve_islands", RowItem::kIslands},
    {kRowProgram, "end_outlines", RowItem::kPartOfWorld},
    {kRowProgram, "reset_rows", RowItem::kPartOfWorld},
    {kRowProgram, "restore_rows", RowItem::kPartOfWorld},
    {kRowProgram, "give_rows", RowItem::kEntry},
    {kRowProgram, "gather_rows", RowItem::kEntry},
    {kRowProgram, "command_rows", RowItem::kEntry},
    {kRowProgram, "clear_rows", RowItem::kEntry},
    {kRowProgram, "place_rows", RowItem::kPartOfWorld},
    {kRowProgram, "reset_flagged_rows", RowItem::kPartOfWorld},
}};

/// The launches that solve the islands of a step, in this order.
struct IslandLaunch {
  RowKernel kernel;
  uint32_t kinds;  ///< see kernels/islands.cl
};

inline constexpr IslandLaunch kIslandLaunches[] = {
    {kSolveSmall, ROW_SMALL_KINDS}, {kSolveSmall, 1u << ROW_SLOW}, {kSolveLarge, 1u << ROW_LARGE}};

}  // namespace Stg::cl

#endif
