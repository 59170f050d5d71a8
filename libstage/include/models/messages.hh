// SPDX-License-Identifier: GPL-2.0-or-later
//
// The message macros of Stage's interface, for controllers and programs. Errors go to standard
// error, warnings and messages to standard output. The first argument is a printf format, a string
// literal. Arguments are made printable. The library itself uses messages/report.hh.

#ifndef STAGE_MODELS_MESSAGES_HH
#define STAGE_MODELS_MESSAGES_HH

#include <stdio.h>

#include "messages/log.hh"

#define STG_PRINT(stream, tag, ...) \
  ::Stg::internal::PrintMessage(stream, tag, nullptr, nullptr, __VA_ARGS__)
#define STG_PRINT_AT(stream, tag, ...) \
  ::Stg::internal::PrintMessage(stream, tag, __FILE__, __FUNCTION__, __VA_ARGS__)
#define STG_RED_ERR "\033[41merr\033[0m"
#define STG_BLUE_WARN "\033[44mwarn\033[0m"

#define PRINT_ERR(m) STG_PRINT_AT(stderr, STG_RED_ERR, m)
#define PRINT_ERR1(m, a) STG_PRINT_AT(stderr, STG_RED_ERR, m, a)
#define PRINT_ERR2(m, a, b) STG_PRINT_AT(stderr, STG_RED_ERR, m, a, b)
#define PRINT_ERR3(m, a, b, c) STG_PRINT_AT(stderr, STG_RED_ERR, m, a, b, c)
#define PRINT_ERR4(m, a, b, c, d) STG_PRINT_AT(stderr, STG_RED_ERR, m, a, b, c, d)
#define PRINT_ERR5(m, a, b, c, d, e) STG_PRINT_AT(stderr, STG_RED_ERR, m, a, b, c, d, e)

#define PRINT_WARN(m) STG_PRINT_AT(stdout, STG_BLUE_WARN, m)
#define PRINT_WARN1(m, a) STG_PRINT_AT(stdout, STG_BLUE_WARN, m, a)
#define PRINT_WARN2(m, a, b) STG_PRINT_AT(stdout, STG_BLUE_WARN, m, a, b)
#define PRINT_WARN3(m, a, b, c) STG_PRINT_AT(stdout, STG_BLUE_WARN, m, a, b, c)
#define PRINT_WARN4(m, a, b, c, d) STG_PRINT_AT(stdout, STG_BLUE_WARN, m, a, b, c, d)
#define PRINT_WARN5(m, a, b, c, d, e) STG_PRINT_AT(stdout, STG_BLUE_WARN, m, a, b, c, d, e)

#ifdef DEBUG
#define PRINT_MSG(m) STG_PRINT_AT(stdout, "Stage", m)
#define PRINT_MSG1(m, a) STG_PRINT_AT(stdout, "Stage", m, a)
#define PRINT_MSG2(m, a, b) STG_PRINT_AT(stdout, "Stage", m, a, b)
#define PRINT_MSG3(m, a, b, c) STG_PRINT_AT(stdout, "Stage", m, a, b, c)
#define PRINT_MSG4(m, a, b, c, d) STG_PRINT_AT(stdout, "Stage", m, a, b, c, d)
#define PRINT_MSG5(m, a, b, c, d, e) STG_PRINT_AT(stdout, "Stage", m, a, b, c, d, e)
#define PRINT_DEBUG(m) STG_PRINT_AT(stdout, "debug", m)
#define PRINT_DEBUG1(m, a) STG_PRINT_AT(stdout, "debug", m, a)
#define PRINT_DEBUG2(m, a, b) STG_PRINT_AT(stdout, "debug", m, a, b)
#define PRINT_DEBUG3(m, a, b, c) STG_PRINT_AT(stdout, "debug", m, a, b, c)
#define PRINT_DEBUG4(m, a, b, c, d) STG_PRINT_AT(stdout, "debug", m, a, b, c, d)
#define PRINT_DEBUG5(m, a, b, c, d, e) STG_PRINT_AT(stdout, "debug", m, a, b, c, d, e)
#else
#define PRINT_MSG(m) STG_PRINT(stdout, "Stage", m)
#define PRINT_MSG1(m, a) STG_PRINT(stdout, "Stage", m, a)
#define PRINT_MSG2(m, a, b) STG_PRINT(stdout, "Stage", m, a, b)
#define PRINT_MSG3(m, a, b, c) STG_PRINT(stdout, "Stage", m, a, b, c)
#define PRINT_MSG4(m, a, b, c, d) STG_PRINT(stdout, "Stage", m, a, b, c, d)
#define PRINT_MSG5(m, a, b, c, d, e) STG_PRINT(stdout, "Stage", m, a, b, c, d, e)
#define PRINT_DEBUG(m)
#define PRINT_DEBUG1(m, a)
#define PRINT_DEBUG2(m, a, b)
#define PRINT_DEBUG3(m, a, b, c)
#define PRINT_DEBUG4(m, a, b, c, d)
#define PRINT_DEBUG5(m, a, b, c, d, e)
#endif

/// A `for` header over a container with an iterator I. C is evaluated twice and must not change.
// NOLINTNEXTLINE(bugprone-macro-parentheses): a name that is declared stands in no parentheses.
#define VAR(V, init) __typeof(init) V = (init)
#define FOR_EACH(I, C) for (VAR(I, (C).begin()), ite = (C).end(); (I) != ite; ++(I))

#endif
