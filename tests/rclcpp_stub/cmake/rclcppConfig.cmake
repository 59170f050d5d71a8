# SPDX-License-Identifier: GPL-2.0-or-later
#
# find_package(rclcpp) for tests: the stand-in, with the messages and the serialization of ROS.

find_package(rcl_interfaces REQUIRED)
find_package(rmw REQUIRED)
# The exported target needs libraries of the machine on which PyPI's wheel was made.
find_library(STAGE_RMW_LIBRARY rmw_fastrtps_cpp REQUIRED)
find_package(Threads REQUIRED)
if(NOT TARGET rclcpp::rclcpp)
  get_filename_component(stub "${CMAKE_CURRENT_LIST_DIR}" DIRECTORY)
  set(messages ${rcl_interfaces_TARGETS})
  list(FILTER messages INCLUDE REGEX "_cpp$")
  add_library(rclcpp_stub SHARED "${stub}/stub.cc")
  target_compile_features(rclcpp_stub PUBLIC cxx_std_17)
  target_include_directories(rclcpp_stub PUBLIC "${stub}/include")
  target_link_libraries(rclcpp_stub PUBLIC ${messages} rmw::rmw "${STAGE_RMW_LIBRARY}"
                                           Threads::Threads)
  target_link_options(rclcpp_stub PUBLIC -Wl,--allow-shlib-undefined)
  add_library(rclcpp::rclcpp ALIAS rclcpp_stub)
endif()
