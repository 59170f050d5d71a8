# SPDX-License-Identifier: GPL-2.0-or-later
#
# Finds the window's libraries. Defines the imported targets stage_fltk, OpenGL::GL, OpenGL::GLU, Freetype::Freetype,
# Fontconfig::Fontconfig and, if available, OpenGL::EGL. window_libraries_FOUND is true if all but EGL were found.

set(OpenGL_GL_PREFERENCE GLVND)
find_package(OpenGL QUIET OPTIONAL_COMPONENTS EGL)
find_package(X11 QUIET)
find_package(Freetype QUIET)
find_package(Fontconfig QUIET)

find_path(FLTK_HEADERS FL/Fl_Gl_Window.H)
set(fltk_libraries "")
foreach(part IN ITEMS fltk_images fltk_gl fltk)
  find_library(${part}_LIBRARY ${part})
  list(APPEND fltk_libraries "${${part}_LIBRARY}")
  mark_as_advanced(${part}_LIBRARY)
endforeach()
mark_as_advanced(FLTK_HEADERS)

set(window_libraries_FOUND FALSE)
if(FLTK_HEADERS
   AND NOT fltk_libraries MATCHES "NOTFOUND"
   AND TARGET OpenGL::GL
   AND TARGET OpenGL::GLU
   AND TARGET Freetype::Freetype
   AND TARGET Fontconfig::Fontconfig
   AND X11_FOUND)
  set(window_libraries_FOUND TRUE)
  add_library(stage_fltk INTERFACE IMPORTED)
  set_target_properties(
    stage_fltk
    PROPERTIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${FLTK_HEADERS}"
               INTERFACE_INCLUDE_DIRECTORIES "${FLTK_HEADERS}"
               INTERFACE_LINK_LIBRARIES "${fltk_libraries};${X11_LIBRARIES}")
endif()
