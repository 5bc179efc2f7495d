#include "sandbox/system_calls.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <initializer_list>
#include <vector>

#include "sandbox/failure.h"

namespace relign::sandbox {
namespace {

#if defined(__x86_64__)
constexpr unsigned kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr unsigned kArchitecture = AUDIT_ARCH_AARCH64;
#else
#error "relign-sandbox has no filter for this architecture"
#endif

constexpr unsigned kX32Bit = 0x40000000;  // system calls of the x32 interface of x86-64
constexpr unsigned kLastOld = 334;        // rseq; later numbers, from 424 on, are equal on all architectures
// Of newer headers than this program needs.
constexpr unsigned kReserveMemory = 73, kNamespaceCookie = 71;  // SO_RESERVE_MEM, SO_NETNS_COOKIE
constexpr unsigned kPassPidfd = 76, kPeerPidfd = 77;            // SO_PASSPIDFD, SO_PEERPIDFD
constexpr unsigned kCold = 20, kPageOut = 21;                   // MADV_COLD, MADV_PAGEOUT
constexpr unsigned kTerminalSettings = 0x802C542A;              // TCGETS2
constexpr unsigned kNewNamespaces =
    CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET;

// Refused with EPERM.
constexpr unsigned kRefused[] = {
    // other processes
    SYS_ptrace,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_kcmp,
    SYS_perf_event_open,
    SYS_get_robust_list,
    SYS_migrate_pages,
    SYS_move_pages,
    // which pages of shared files are in memory: one trial could leave a message to the next
    SYS_fadvise64,
    SYS_readahead,
    SYS_mincore,
    // what outlives a process, or is shared with others: keys, System V memory, queues, locks and notices on files
    SYS_add_key,
    SYS_request_key,
    SYS_keyctl,
    SYS_shmget,
    SYS_shmat,
    SYS_shmctl,
    SYS_semget,
    SYS_semctl,
    SYS_semop,
    SYS_semtimedop,
    SYS_msgget,
    SYS_msgsnd,
    SYS_msgrcv,
    SYS_msgctl,
    SYS_mq_open,
    SYS_mq_unlink,
    SYS_flock,
    SYS_inotify_init1,
    SYS_inotify_add_watch,
    SYS_fanotify_init,
    SYS_fanotify_mark,
    SYS_sync,
    SYS_syncfs,
    // memory that escapes the limits: memory files, filters of system calls
    SYS_memfd_create,
    SYS_seccomp,
    // new views of the machine
    SYS_mount,
    SYS_umount2,
    SYS_pivot_root,
    SYS_chroot,
    SYS_unshare,
    SYS_setns,
    SYS_name_to_handle_at,
    SYS_open_by_handle_at,
    // administration, and kernel code that no algorithm needs
    SYS_bpf,
    SYS_userfaultfd,
    SYS_init_module,
    SYS_finit_module,
    SYS_delete_module,
    SYS_kexec_load,
    SYS_reboot,
    SYS_swapon,
    SYS_swapoff,
    SYS_acct,
    SYS_quotactl,
    SYS_syslog,
    SYS_settimeofday,
    SYS_clock_settime,
    SYS_adjtimex,
    SYS_clock_adjtime,
    SYS_sethostname,
    SYS_setdomainname,
    SYS_vhangup,
    SYS_personality,
    SYS_io_setup,
#if defined(__x86_64__)
    SYS_inotify_init,
    SYS_kexec_file_load,
    SYS_iopl,
    SYS_ioperm,
    SYS_modify_ldt,
    SYS_uselib,
    SYS_ustat,
#endif
};

// "Do not exist" (ENOSYS): libraries copy instead. They leave pages in pipes and sockets that no process has.
constexpr unsigned kMissing[] = {SYS_splice, SYS_vmsplice, SYS_tee, SYS_sendfile};

// Those after kLastOld that are allowed. Others "do not exist" (ENOSYS), so that libraries use the older ones.
constexpr unsigned kAllowedNew[] = {
    424,  // pidfd_send_signal
    434,  // pidfd_open
    436,  // close_range
    437,  // openat2
    439,  // faccessat2
    441,  // epoll_pwait2
    449,  // futex_waitv
    452,  // fchmodat2
    453,  // map_shadow_stack
    454,  // futex_wake
    455,  // futex_wait
    456,  // futex_requeue
    462,  // mseal
};

// A list of instructions; a rule is a test of the loaded number followed by its answer.
class Filter {
 public:
  void load(std::size_t offset) { add(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offset), 0, 0); }
  void answer(unsigned value) { add(BPF_RET | BPF_K, value, 0, 0); }
  void unless_equal(unsigned value, std::size_t skip) { add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, skip); }
  void unless_different(unsigned value, std::size_t skip) { add(BPF_JMP | BPF_JEQ | BPF_K, value, skip, 0); }
  void unless_any_bit(unsigned bits, std::size_t skip) { add(BPF_JMP | BPF_JSET | BPF_K, bits, 0, skip); }
  void unless_above(unsigned value, std::size_t skip) { add(BPF_JMP | BPF_JGT | BPF_K, value, 0, skip); }
  void if_equal_answer(unsigned value, unsigned reply) {
    unless_equal(value, 1);
    answer(reply);
  }
  std::vector<sock_filter>& code() { return code_; }

 private:
  void add(unsigned short operation, unsigned value, std::size_t yes, std::size_t no) {
    code_.push_back({operation, static_cast<unsigned char>(yes), static_cast<unsigned char>(no), value});
  }
  std::vector<sock_filter> code_;
};

constexpr unsigned error(int code) { return SECCOMP_RET_ERRNO | static_cast<unsigned>(code); }

// The low half of an argument: both architectures are little-endian.
constexpr std::size_t argument(unsigned number) { return offsetof(seccomp_data, args) + 8 * number; }

// Answers a call with one of these values of an argument by `reply`, any other by `otherwise`.
void answer_values(Filter& filter, unsigned call, unsigned number, std::initializer_list<unsigned> values,
                   unsigned reply, unsigned otherwise) {
  filter.unless_equal(call, 2 + 2 * values.size());
  filter.load(argument(number));
  for (const unsigned value : values) filter.if_equal_answer(value, reply);
  filter.answer(otherwise);
}

void refuse_values(Filter& filter, unsigned call, unsigned number, std::initializer_list<unsigned> values, int code) {
  answer_values(filter, call, number, values, error(code), SECCOMP_RET_ALLOW);
}

void allow_values(Filter& filter, unsigned call, unsigned number, std::initializer_list<unsigned> values, int code) {
  answer_values(filter, call, number, values, SECCOMP_RET_ALLOW, error(code));
}

void refuse_arguments(Filter& filter) {
  // Sockets of a pair or with a path in the sandbox, no others: the kernel does not separate all families (vsock).
  for (const unsigned call : {SYS_socket, SYS_socketpair}) allow_values(filter, call, 0, {AF_UNIX}, EACCES);
  // Of terminals and of any descriptor. Those of files leave marks on files that other sandboxes see as well.
  allow_values(filter, SYS_ioctl, 1,
               {TCGETS, kTerminalSettings, TIOCGWINSZ, TIOCGPGRP, FIONREAD, FIONBIO, FIOASYNC, FIOCLEX, FIONCLEX},
               ENOTTY);
  // Process 1 enforces the limits: no other process changes its limits, processors or priority.
  for (const unsigned call :
       {SYS_prlimit64, SYS_sched_setaffinity, SYS_sched_setscheduler, SYS_sched_setparam, SYS_sched_setattr})
    refuse_values(filter, call, 0, {1}, EPERM);
  for (const unsigned call : {SYS_setpriority, SYS_ioprio_set}) {
    const unsigned process = call == SYS_setpriority ? PRIO_PROCESS : 1;  // IOPRIO_WHO_PROCESS; not all of a user
    filter.unless_equal(call, 7);
    filter.load(argument(0));
    filter.unless_different(process, 1);
    filter.answer(error(EPERM));
    filter.load(argument(1));
    filter.if_equal_answer(1, error(EPERM));
    filter.answer(SECCOMP_RET_ALLOW);
  }
  // Memory of the kernel that supervisor.cpp does not count, and numbers that count the sockets of the whole machine.
  refuse_values(filter, SYS_setsockopt, 2,
                {SO_SNDBUF, SO_RCVBUF, SO_SNDBUFFORCE, SO_RCVBUFFORCE, kReserveMemory, kPassPidfd}, EPERM);
  refuse_values(filter, SYS_getsockopt, 2, {SO_COOKIE, kNamespaceCookie, kPeerPidfd}, ENOPROTOOPT);
  refuse_values(filter, SYS_prctl, 0, {PR_SET_SECCOMP}, EPERM);
  // Shared memory without a file: what is not mapped any more stays, and counts for no process.
  filter.unless_equal(SYS_mmap, 5);
  filter.load(argument(3));
  filter.unless_any_bit(MAP_ANONYMOUS, 2);
  filter.unless_any_bit(MAP_SHARED, 1);
  filter.answer(error(EPERM));
  filter.answer(SECCOMP_RET_ALLOW);
  // RWF_NOWAIT succeeds if a page is in memory, advice removes it.
  for (const unsigned call : {SYS_preadv2, SYS_pwritev2}) {
    filter.unless_equal(call, 4);
    filter.load(argument(5));
    filter.unless_different(0, 1);
    filter.answer(error(EOPNOTSUPP));
    filter.answer(SECCOMP_RET_ALLOW);
  }
  refuse_values(filter, SYS_madvise, 2, {MADV_WILLNEED, kCold, kPageOut}, EPERM);
  filter.unless_equal(SYS_clone, 4);
  filter.load(argument(0));
  filter.unless_any_bit(kNewNamespaces, 1);
  filter.answer(error(EPERM));
  filter.answer(SECCOMP_RET_ALLOW);
  // Locks, notices and hints on files that other sandboxes see as well; larger pipes.
  refuse_values(filter, SYS_fcntl, 1,
                {F_SETLK, F_SETLKW, F_GETLK, F_OFD_SETLK, F_OFD_SETLKW, F_OFD_GETLK, F_SETLEASE, F_NOTIFY,
                 F_GET_RW_HINT, F_SET_RW_HINT, F_GET_FILE_RW_HINT, F_SET_FILE_RW_HINT, F_SETPIPE_SZ},
                ENOLCK);
}

Filter make_filter() {
  Filter filter;
  filter.load(offsetof(seccomp_data, arch));
  filter.unless_different(kArchitecture, 1);
  filter.answer(SECCOMP_RET_KILL_PROCESS);
  filter.load(offsetof(seccomp_data, nr));
#if defined(__x86_64__)
  filter.unless_any_bit(kX32Bit, 1);
  filter.answer(error(ENOSYS));
#endif
  for (const unsigned call : kRefused) filter.if_equal_answer(call, error(EPERM));
  for (const unsigned call : kMissing) filter.if_equal_answer(call, error(ENOSYS));
  for (const unsigned call : kAllowedNew) filter.if_equal_answer(call, SECCOMP_RET_ALLOW);
  filter.unless_above(kLastOld, 1);
  filter.answer(error(ENOSYS));
  refuse_arguments(filter);
  filter.answer(SECCOMP_RET_ALLOW);
  return filter;
}

}  // namespace

void filter_system_calls() {
  Filter filter = make_filter();
  const sock_fprog program{static_cast<unsigned short>(filter.code().size()), filter.code().data()};
  require(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0, "cannot give up privileges");
  require(::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program) == 0,
          "cannot filter system calls (the kernel needs CONFIG_SECCOMP_FILTER)");
}

}  // namespace relign::sandbox
