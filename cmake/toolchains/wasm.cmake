# SPDX-License-Identifier: GPL-2.0-or-later
#
# Compiles to WebAssembly for Node with Emscripten. Expects the libraries in /opt/wasm, as in the tree that tools/dev/wasm
# makes.

include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)

list(APPEND CMAKE_FIND_ROOT_PATH /opt/wasm)
set(CMAKE_CXX_FLAGS_INIT "-fwasm-exceptions -include ${CMAKE_CURRENT_LIST_DIR}/atomic_ref.hh")
# NODERAWFS: the program sees the files of the machine.
string(JOIN " " CMAKE_EXE_LINKER_FLAGS_INIT -fwasm-exceptions -sALLOW_MEMORY_GROWTH -sEXIT_RUNTIME -sSTACK_SIZE=8MB
       -sENVIRONMENT=node -sNODERAWFS)
