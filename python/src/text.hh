// SPDX-License-Identifier: GPL-2.0-or-later
//
// Converts strings between C++ and Python; replaces <nanobind/stl/string.h>.
//
// Names in world files may contain any bytes. Bytes that are not UTF-8 become lone surrogates in
// Python and are converted back to the same bytes, as Python does with file names (PEP 383, the
// error handler "surrogateescape").

#ifndef STAGE_PYTHON_TEXT_HH
#define STAGE_PYTHON_TEXT_HH

#include <nanobind/nanobind.h>

#include <string>

namespace nanobind::detail {

template <>
struct type_caster<std::string> {
  NB_TYPE_CASTER(std::string, const_name("str"))

  bool from_python(handle source, uint32_t, cleanup_list*) noexcept {
    if (!PyUnicode_Check(source.ptr())) return false;
    const object bytes = steal(PyUnicode_AsEncodedString(source.ptr(), "utf-8", "surrogateescape"));
    char* data = nullptr;
    Py_ssize_t size = 0;
    if (!bytes.is_valid() || PyBytes_AsStringAndSize(bytes.ptr(), &data, &size) != 0) {
      PyErr_Clear();
      return false;
    }
    value.assign(data, static_cast<size_t>(size));
    return true;
  }

  static handle from_cpp(const std::string& text, rv_policy, cleanup_list*) noexcept {
    return PyUnicode_DecodeUTF8(text.c_str(), static_cast<Py_ssize_t>(text.size()),
                                "surrogateescape");
  }
};

}  // namespace nanobind::detail

#endif
