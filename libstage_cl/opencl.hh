// SPDX-License-Identifier: GPL-2.0-or-later
//
// OpenCL's C++ bindings with exceptions. Uses host calls up to OpenCL 1.1 only, for old drivers.
// All calls are marked (calls.hh).

#ifndef STAGE_CL_OPENCL_HH
#define STAGE_CL_OPENCL_HH

#include "libstage_cl/calls.hh"

#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_MINIMUM_OPENCL_VERSION 110
#define CL_HPP_TARGET_OPENCL_VERSION 110
// Newer bindings mention a function of 1.2, which must be declared although it is never called.
#define CL_TARGET_OPENCL_VERSION 120
#define CL_USE_DEPRECATED_OPENCL_1_1_APIS

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
#pragma GCC diagnostic ignored "-Wignored-attributes"
#include <CL/opencl.h>

// Redirects the functions that the bindings call to marked ones. The list has all functions that
// the plug-in uses; a test finds missing ones.
#define STAGE_CL_MARKED(function) Stg::cl::calls::Marked<#function, &::function>::Call
#define clBuildProgram STAGE_CL_MARKED(clBuildProgram)
#define clCreateBuffer STAGE_CL_MARKED(clCreateBuffer)
#define clCreateCommandQueue STAGE_CL_MARKED(clCreateCommandQueue)
#define clCreateContext STAGE_CL_MARKED(clCreateContext)
#define clCreateKernel STAGE_CL_MARKED(clCreateKernel)
#define clCreateProgramWithSource STAGE_CL_MARKED(clCreateProgramWithSource)
#define clEnqueueMapBuffer STAGE_CL_MARKED(clEnqueueMapBuffer)
#define clEnqueueNDRangeKernel STAGE_CL_MARKED(clEnqueueNDRangeKernel)
#define clEnqueueReadBuffer STAGE_CL_MARKED(clEnqueueReadBuffer)
#define clEnqueueUnmapMemObject STAGE_CL_MARKED(clEnqueueUnmapMemObject)
#define clEnqueueWriteBuffer STAGE_CL_MARKED(clEnqueueWriteBuffer)
#define clFinish STAGE_CL_MARKED(clFinish)
#define clFlush STAGE_CL_MARKED(clFlush)
#define clGetDeviceIDs STAGE_CL_MARKED(clGetDeviceIDs)
#define clGetDeviceInfo STAGE_CL_MARKED(clGetDeviceInfo)
#define clGetKernelWorkGroupInfo STAGE_CL_MARKED(clGetKernelWorkGroupInfo)
#define clGetPlatformIDs STAGE_CL_MARKED(clGetPlatformIDs)
#define clGetPlatformInfo STAGE_CL_MARKED(clGetPlatformInfo)
#define clGetProgramBuildInfo STAGE_CL_MARKED(clGetProgramBuildInfo)
#define clGetProgramInfo STAGE_CL_MARKED(clGetProgramInfo)
#define clReleaseCommandQueue STAGE_CL_MARKED(clReleaseCommandQueue)
#define clReleaseContext STAGE_CL_MARKED(clReleaseContext)
#define clReleaseEvent STAGE_CL_MARKED(clReleaseEvent)
#define clReleaseKernel STAGE_CL_MARKED(clReleaseKernel)
#define clReleaseMemObject STAGE_CL_MARKED(clReleaseMemObject)
#define clReleaseProgram STAGE_CL_MARKED(clReleaseProgram)
#define clRetainCommandQueue STAGE_CL_MARKED(clRetainCommandQueue)
#define clRetainContext STAGE_CL_MARKED(clRetainContext)
#define clRetainKernel STAGE_CL_MARKED(clRetainKernel)
#define clRetainMemObject STAGE_CL_MARKED(clRetainMemObject)
#define clSetKernelArg STAGE_CL_MARKED(clSetKernelArg)
#define clWaitForEvents STAGE_CL_MARKED(clWaitForEvents)

#include <CL/opencl.hpp>
#pragma GCC diagnostic pop

#endif
