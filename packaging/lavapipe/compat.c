// Functions that Debian's headers and static archives ask for and glibc 2.28 lacks. They are linked into the driver and
// the loader (hidden, never exported). The number is the version of glibc that brought the function.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <malloc.h>
#include <pthread.h>
#include <stdarg.h>
#include <stddef.h>
#include <sys/random.h>
#include <time.h>

// 2.38: the names that the headers of C23 give these functions. They differ from the old ones in accepting "0b101".
// The old names are declared here because the headers would rename them, too.
#define RENAMED(type, name)                                                                                            \
    extern type old_##name(const char *, char **, int) __asm__(#name);                                                 \
    type __isoc23_##name(const char *text, char **end, int base) { return old_##name(text, end, base); }
RENAMED(long, strtol)
RENAMED(long long, strtoll)
RENAMED(unsigned long, strtoul)
RENAMED(unsigned long long, strtoull)

extern int old_vsscanf(const char *, const char *, va_list) __asm__("vsscanf");
int __isoc23_sscanf(const char *text, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int count = old_vsscanf(text, format, arguments);
    va_end(arguments);
    return count;
}

// 2.36: libstdc++ seeds hash tables and std::random_device with it. The kernel gives so few bytes without fail.
unsigned arc4random(void) {
    unsigned number = 0;
    getrandom(&number, sizeof number, 0);
    return number;
}

// 2.33: before, these were inline calls with the version of the structure, 1 on x86-64 (0 for mknod). `struct stat` and
// `struct stat64` are the same there. <sys/stat.h> is not included, as it declares them with types of their own.
extern int __xstat(int, const char *, void *), __lxstat(int, const char *, void *), __fxstat(int, int, void *);
extern int __fxstatat(int, int, const char *, void *, int), __xmknod(int, const char *, unsigned, unsigned long *);
int stat(const char *path, void *out) { return __xstat(1, path, out); }
int lstat(const char *path, void *out) { return __lxstat(1, path, out); }
int fstat(int file, void *out) { return __fxstat(1, file, out); }
int fstatat(int folder, const char *path, void *out, int flags) { return __fxstatat(1, folder, path, out, flags); }
int stat64(const char *, void *) __attribute__((alias("stat")));
int lstat64(const char *, void *) __attribute__((alias("lstat")));
int fstat64(int, void *) __attribute__((alias("fstat")));
int fstatat64(int, const char *, void *, int) __attribute__((alias("fstatat")));
int mknod(const char *path, unsigned mode, unsigned long device) { return __xmknod(0, path, mode, &device); }

// 2.33: LLVM asks for the size of its heap, for statistics that nobody reads here.
struct mallinfo2 mallinfo2(void) { return (struct mallinfo2){0}; }

// 2.32: libstdc++ counts references without atomics while this is true.
char __libc_single_threaded = 0;

// 2.30
int pthread_cond_clockwait(pthread_cond_t *condition, pthread_mutex_t *mutex, clockid_t clock,
                           const struct timespec *until) {
    struct timespec now, wall;
    clock_gettime(clock, &now);
    clock_gettime(CLOCK_REALTIME, &wall);
    long nanoseconds = wall.tv_nsec + until->tv_nsec - now.tv_nsec; // within (-1e9, 2e9)
    long carry = nanoseconds < 0 ? -1 : nanoseconds / 1000000000;
    wall.tv_sec += until->tv_sec - now.tv_sec + carry;
    wall.tv_nsec = nanoseconds - carry * 1000000000;
    return pthread_cond_timedwait(condition, mutex, &wall);
}

// 2.35: libgcc finds the unwind table of a function with it when an exception is thrown.
struct search {
    ElfW(Addr) address;
    struct dl_find_object *found;
};

static int visit(struct dl_phdr_info *object, size_t, void *data) {
    struct search *search = data;
    void *table = NULL;
    int holds = 0;
    for (int i = 0; i < object->dlpi_phnum; i++) {
        const ElfW(Phdr) *segment = &object->dlpi_phdr[i];
        ElfW(Addr) start = object->dlpi_addr + segment->p_vaddr;
        if (segment->p_type == PT_LOAD && search->address - start < segment->p_memsz) {
            holds = 1;
            search->found->dlfo_map_start = (void *)start;
            search->found->dlfo_map_end = (void *)(start + segment->p_memsz);
        }
        if (segment->p_type == PT_GNU_EH_FRAME)
            table = (void *)start;
    }
    search->found->dlfo_eh_frame = table;
    return holds && table;
}

int _dl_find_object(void *address, struct dl_find_object *found) {
    struct search search = {(ElfW(Addr))address, found};
    return dl_iterate_phdr(visit, &search) ? 0 : -1;
}
