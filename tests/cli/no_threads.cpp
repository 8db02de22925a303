// SPDX-License-Identifier: GPL-3.0-or-later
// Preloaded by tests; makes every attempt to start a thread fail.
#include <cerrno>

#include <pthread.h>

extern "C" int pthread_create(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*) noexcept {
  return EAGAIN;
}
