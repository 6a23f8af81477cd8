// kphi-sentinel: waits for the end of the program that started it, and says the last words of one that did not come to
// its end. Needs the C library alone, so that it is small and nothing in it can fail.
// Usage: kphi-sentinel (DEVICE udp|tcp|serial|usb WHERE PORT|BAUD|PIPE BYTES ANSWER QUESTION PROOFS FROM LOCK)…, bytes
// in hexadecimal digits, several addresses of one WHERE and several PROOFS with commas. Its standard input is the line
// to that program: "?" is answered with "!", which it also says when it begins to watch; "." releases it; an end
// without that is a death.
#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace {

constexpr int kTries = 5, kFieldsOfAWord = 10, kMostWords = 8;
constexpr int kAnswer_ms = 700, kQuiet_ms = 20, kMostNoise_ms = 300, kConnect_ms = 700, kLockFreed_ms = 100;
constexpr unsigned kTooLong_s = 20;

struct Bytes {
  unsigned char of[256];
  size_t n = 0;
};

int digit(char c) { return c >= 'a' ? c - 'a' + 10 : c - '0'; }

/// Up to a comma.
Bytes from_hex(const char* text) {
  Bytes bytes;
  for (; text[0] != 0 && text[0] != ',' && text[1] != 0 && bytes.n < sizeof bytes.of; text += 2)
    bytes.of[bytes.n++] = static_cast<unsigned char>(digit(text[0]) * 16 + digit(text[1]));
  return bytes;
}

struct Word {
  explicit Word(char** fields)
      : device(fields[0]),
        wire(fields[1]),
        where(fields[2]),
        number(static_cast<unsigned>(strtoul(fields[3], nullptr, 10))),
        bytes(from_hex(fields[4])),
        answer(from_hex(fields[5])),
        question(from_hex(fields[6])),
        proofs(fields[7]),
        from(fields[8]),
        lock(fields[9]) {}
  const char* device;
  const char* wire;
  const char* where;
  unsigned number;
  Bytes bytes, answer, question;
  const char* proofs;
  const char* from;
  const char* lock;
};

bool within(int file, short event, int limit_ms) {
  pollfd wanted{file, event, 0};
  int ready = 0;
  do ready = poll(&wanted, 1, limit_ms);
  while (ready < 0 && errno == EINTR);
  return ready > 0;
}

/// Takes what is still on its way.
void hush(int file) {
  unsigned char rubbish[256];
  for (int waited = 0; waited < kMostNoise_ms && within(file, POLLIN, kQuiet_ms); waited += kQuiet_ms)
    if (read(file, rubbish, sizeof rubbish) <= 0) break;
}

speed_t speed_of(unsigned baud) {
  constexpr struct {
    unsigned baud;
    speed_t speed;
  } kSpeeds[] = {{9600, B9600},     {19200, B19200},   {38400, B38400},   {57600, B57600},
                 {115200, B115200}, {230400, B230400}, {460800, B460800}, {921600, B921600},
                 {1200, B1200},     {2400, B2400},     {4800, B4800}};
  for (const auto& one : kSpeeds)
    if (one.baud == baud) return one.speed;
  return B115200;
}

int opened_serial(const Word& word) {
  const int port = open(word.where, O_RDWR | O_NOCTTY | O_NONBLOCK);
  termios settings{};
  if (port < 0 || tcgetattr(port, &settings) != 0) return port;
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  cfsetspeed(&settings, speed_of(word.number));
  tcsetattr(port, TCSANOW, &settings);
  hush(port);  // an answer to the dead program may still be on its way
  return port;
}

/// How many addresses a host has.
int addresses_of(const char* where) {
  int n = 1;
  for (; *where != 0; ++where) n += *where == ',';
  return n;
}

/// At its address number `which`.
int opened_socket(const Word& word, int type, int which) {
  char where[64] = "";
  const char* begin = word.where;
  while (which-- > 0) begin = strchr(begin, ',') + 1;
  const size_t n = strcspn(begin, ",");
  if (n < sizeof where) memcpy(where, begin, n);
  sockaddr_storage to{};
  auto* v4 = reinterpret_cast<sockaddr_in*>(&to);
  auto* v6 = reinterpret_cast<sockaddr_in6*>(&to);
  socklen_t length = sizeof *v4;
  if (inet_pton(AF_INET, where, &v4->sin_addr) == 1) {
    v4->sin_family = AF_INET;
    v4->sin_port = htons(static_cast<uint16_t>(word.number));
  } else if (inet_pton(AF_INET6, where, &v6->sin6_addr) == 1) {
    v6->sin6_family = AF_INET6;
    v6->sin6_port = htons(static_cast<uint16_t>(word.number));
    length = sizeof *v6;
  }
  const int file = socket(to.ss_family, type | SOCK_NONBLOCK, 0);
  if (file < 0) return -1;
  sockaddr_in own{};
  own.sin_family = AF_INET;
  // Where its card is gone, the kernel may still know another way.
  if (inet_pton(AF_INET, word.from, &own.sin_addr) == 1)
    (void)!bind(file, reinterpret_cast<sockaddr*>(&own), sizeof own);
  if (connect(file, reinterpret_cast<sockaddr*>(&to), length) == 0) return file;
  if (errno == EINPROGRESS && within(file, POLLOUT, kConnect_ms)) return file;
  close(file);
  return -1;
}

/// One transfer; the bytes that it moved, -1: none in time.
int transferred(int file, unsigned char type, unsigned char endpoint, unsigned char* bytes, size_t n) {
  usbdevfs_urb urb{};
  urb.type = type;
  urb.endpoint = endpoint;
  urb.buffer = bytes;
  urb.buffer_length = static_cast<int>(n);
  if (ioctl(file, USBDEVFS_SUBMITURB, &urb) != 0) return -1;
  usbdevfs_urb* ended = nullptr;
  for (int waited = 0; ioctl(file, USBDEVFS_REAPURBNDELAY, &ended) != 0; ++waited) {
    if (errno != EAGAIN) return -1;
    if (waited == kAnswer_ms) ioctl(file, USBDEVFS_DISCARDURB, &urb);
    if (waited > 2 * kAnswer_ms) return -1;
    poll(nullptr, 0, 1);
  }
  return urb.status == 0 ? urb.actual_length : -1;
}

/// A USBTMC request to the interface (USBTMC 4.2.1), and the status that answers it.
int requested(int file, unsigned char request, unsigned char interface, unsigned char answers) {
  unsigned char setup[10] = {0xA1, request, 0, 0, interface, 0, answers, 0};
  return transferred(file, USBDEVFS_URB_TYPE_CONTROL, 0, setup, 8u + answers) > 0 ? setup[8] : -1;
}

/// To a USBTMC instrument that its dead program may have left in the middle of a message.
bool told_over_usb(const Word& word) {
  constexpr unsigned char kClear = 5, kCheckClear = 6, kPending = 2;
  auto interface = static_cast<unsigned char>(word.number & 0xFF);
  unsigned endpoint = word.number >> 8;
  const int file = open(word.where, O_RDWR);
  if (file < 0) return false;
  usbdevfs_disconnect_claim claim{};
  claim.interface = interface;
  unsigned number = interface;
  if (ioctl(file, USBDEVFS_DISCONNECT_CLAIM, &claim) != 0) ioctl(file, USBDEVFS_CLAIMINTERFACE, &number);
  requested(file, kClear, interface, 1);
  for (int i = 0; i < kQuiet_ms && requested(file, kCheckClear, interface, 2) == kPending; ++i) poll(nullptr, 0, 1);
  ioctl(file, USBDEVFS_CLEAR_HALT, &endpoint);
  Bytes message = word.bytes;
  const int sent =
      transferred(file, USBDEVFS_URB_TYPE_BULK, static_cast<unsigned char>(endpoint), message.of, message.n);
  close(file);
  return sent == static_cast<int>(message.n);
}

bool holds(const Bytes& seen, const Bytes& wanted) { return memmem(seen.of, seen.n, wanted.of, wanted.n) != nullptr; }

enum class Heard { nothing, another, wanted };

/// Whether it answers with one of these, written with commas.
Heard heard(int file, const char* wanted) {
  Bytes seen;
  while (seen.n < sizeof seen.of && within(file, POLLIN, kAnswer_ms)) {
    const ssize_t n = read(file, seen.of + seen.n, sizeof seen.of - seen.n);
    if (n <= 0) break;
    seen.n += static_cast<size_t>(n);
    for (const char* one = wanted; one != nullptr; one = strchr(one, ',')) {
      one += *one == ',';
      if (holds(seen, from_hex(one))) return Heard::wanted;
    }
  }
  return seen.n > 0 ? Heard::another : Heard::nothing;
}

bool sent(int file, const Bytes& bytes) { return write(file, bytes.of, bytes.n) == static_cast<ssize_t>(bytes.n); }

/// Takes the lock that its death frees, before the next program can: that one waits. The kernel frees it a little later
/// than it ends the line. False: another program has it.
bool takes(const char* lock) {
  if (*lock == 0) return true;
  const int file = open(lock, O_RDONLY | O_CLOEXEC);
  for (int waited = 0; file >= 0 && flock(file, LOCK_EX | LOCK_NB) != 0; ++waited) {
    if (waited == kLockFreed_ms) return false;
    poll(nullptr, 0, 1);
  }
  return true;  // held to the end of this process
}

enum class Outcome {
  silent,  ///< nothing was heard of it, or it could not be told
  still,   ///< it says that it is still on
  told,    ///< the bytes have left, or were acknowledged; it cannot be asked
  off,     ///< it says that it is off
};

/// The order, on an open line, and what the device says of itself afterwards.
Outcome say_to(int file, const Word& word, const char* answer) {
  if (!sent(file, word.bytes) || (word.answer.n > 0 && heard(file, answer) != Heard::wanted)) return Outcome::silent;
  if (word.question.n == 0) return Outcome::told;
  hush(file);  // the rest of its answer
  if (!sent(file, word.question)) return Outcome::silent;
  switch (heard(file, word.proofs)) {
    case Heard::wanted:
      return Outcome::off;
    case Heard::another:
      return Outcome::still;
    case Heard::nothing:
      break;
  }
  return Outcome::silent;
}

/// The best that became of it.
Outcome say(const Word& word, const char* answer) {
  const bool serial = strcmp(word.wire, "serial") == 0, udp = strcmp(word.wire, "udp") == 0;
  const int addresses = udp || strcmp(word.wire, "tcp") == 0 ? addresses_of(word.where) : 1;
  Outcome best = Outcome::silent;
  for (int attempt = 0; attempt < kTries || attempt % addresses != 0; ++attempt) {
    if (strcmp(word.wire, "usb") == 0) {
      if (told_over_usb(word)) return Outcome::told;
      poll(nullptr, 0, kQuiet_ms);
      continue;
    }
    const int which = attempt % addresses;
    const int file = serial ? opened_serial(word) : opened_socket(word, udp ? SOCK_DGRAM : SOCK_STREAM, which);
    if (file < 0) {
      poll(nullptr, 0, kQuiet_ms);
      continue;
    }
    const Outcome outcome = say_to(file, word, answer);
    close(file);
    if (outcome > best) best = outcome;
    // A datagram does not tell whether anybody was there: each address gets one.
    if (outcome >= Outcome::told && (!udp || which + 1 == addresses)) break;
  }
  return best;
}

const char* words_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::silent:
      return "DOES NOT ANSWER, switch it off by hand";
    case Outcome::still:
      return "was told to switch off and IS STILL ON, switch it off by hand";
    case Outcome::told:
      return "told to stop";
    case Outcome::off:
      return "switched off";
  }
  return "";
}

/// Returns when that program has released it, true, or has died.
bool is_released() {
  constexpr char kHere = '!';
  (void)!write(STDIN_FILENO, &kHere, 1);
  for (char heard = 0;;) {
    const ssize_t n = read(STDIN_FILENO, &heard, 1);
    if (n < 0 && errno == EINTR) continue;
    if (n == 1 && heard == '?') {
      (void)!write(STDIN_FILENO, &kHere, 1);
      continue;
    }
    return n == 1;
  }
}

}  // namespace

int main(int count, char** arguments) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGTSTP, SIGTTIN, SIGTTOU})
    signal(number, SIG_IGN);
  syscall(SYS_close_range, 3u, ~0u, 0u);  // what that program held: ports and locks, which its death must free
  (void)!chdir("/");
  if (is_released()) return 0;

  alarm(kTooLong_s);
  const int words = (count - 1) / kFieldsOfAWord < kMostWords ? (count - 1) / kFieldsOfAWord : kMostWords;
  bool free[kMostWords];
  char** fields = arguments + 1;
  for (int i = 0; i < words; ++i, fields += kFieldsOfAWord) free[i] = takes(fields[kFieldsOfAWord - 1]);
  int failed = 0;
  fields = arguments + 1;
  for (int i = 0; i < words; ++i, fields += kFieldsOfAWord) {
    if (!free[i]) continue;
    const Word word(fields);
    const Outcome outcome = say(word, fields[5]);
    failed += outcome < Outcome::told;
    fprintf(stderr, "kphi-sentinel: kphi has died; %s: %s\n", word.device, words_of(outcome));
  }
  return failed == 0 ? 0 : 1;
}
