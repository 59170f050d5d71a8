# SPDX-License-Identifier: GPL-2.0-or-later
#
# find_package(rclcpp_components) for tests. The executable of a component is the driver of the tests.

if(NOT TARGET rclcpp_components::component)
  add_library(rclcpp_components::component INTERFACE IMPORTED)
endif()

# rclcpp_components_register_node(TARGET PLUGIN CLASS EXECUTABLE NAME)
function(rclcpp_components_register_node target)
  cmake_parse_arguments(given "" "PLUGIN;EXECUTABLE" "" ${ARGN})
  if(NOT given_PLUGIN OR NOT given_EXECUTABLE)
    message(FATAL_ERROR "expected PLUGIN and EXECUTABLE")
  endif()
  get_filename_component(stub "${CMAKE_CURRENT_FUNCTION_LIST_DIR}" DIRECTORY)
  add_executable(${given_EXECUTABLE} "${stub}/driver.cc")
  # The component registers itself when it is loaded.
  target_link_options(${given_EXECUTABLE} PRIVATE -Wl,--no-as-needed)
  target_link_libraries(${given_EXECUTABLE} PRIVATE ${target} rclcpp::rclcpp)
endfunction()
