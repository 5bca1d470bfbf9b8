/* Lets a User-Mode Linux run on a processor whose extended registers are larger than its buffer (AMX: 11 kB, of 5.5 kB).
 *
 * Loaded before it (LD_PRELOAD). The host's kernel takes a process's extended registers (NT_X86_XSTATE) whole or not at all
 * (arch/x86/kernel/fpu/regset.c, xstateregs_set). So they are read whole, and what the caller's buffer holds of them is put in.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

static char whole[1 << 16] __attribute__((aligned(64)));

static size_t least(size_t one, size_t other) { return one < other ? one : other; }

long ptrace(enum __ptrace_request request, ...) {
  static long (*real)(enum __ptrace_request, ...);
  va_list rest;
  va_start(rest, request);
  pid_t pid = va_arg(rest, pid_t);
  void *address = va_arg(rest, void *), *data = va_arg(rest, void *);
  va_end(rest);
  if (!real) real = (long (*)(enum __ptrace_request, ...))dlsym(RTLD_NEXT, "ptrace");
  if ((request != PTRACE_GETREGSET && request != PTRACE_SETREGSET) || address != (void *)NT_X86_XSTATE)
    return real(request, pid, address, data);
  struct iovec *asked = data, all = {whole, sizeof whole};
  long failed = real(PTRACE_GETREGSET, pid, address, &all);
  if (failed) return failed;
  if (request == PTRACE_SETREGSET) {
    memcpy(whole, asked->iov_base, least(asked->iov_len, all.iov_len));
    return real(PTRACE_SETREGSET, pid, address, &all);
  }
  asked->iov_len = least(asked->iov_len, all.iov_len);
  memcpy(asked->iov_base, whole, asked->iov_len);
  return 0;
}
