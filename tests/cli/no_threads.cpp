// SPDX-License-Identifier: GPL-3.0-or-later
// Preloaded by tests: the system grants no thread.
#include <cerrno>

#include <pthread.h>

extern "C" int pthread_create(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*) noexcept {
  return EAGAIN;
}
