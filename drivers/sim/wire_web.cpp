// What a script does to the box's answers over HTTP and over its 16-bit interface.
#include <fmt/format.h>

#include <algorithm>

#include "drivers/sim/wire.hpp"

namespace kphi::sim {
namespace {

constexpr std::string_view kEndOfHeaders = "\r\n\r\n";
constexpr std::string_view kXml = "text/xml";

std::string page(std::string_view status, std::string_view type, std::string_view body) {
  return fmt::format("HTTP/1.0 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}", status,
                     type, body.size(), body);
}

std::string failed(int code) {
  const std::string status = fmt::format("{} {}", code, code < 500 ? "Not Found" : "Internal Server Error");
  return page(status, "text/html", "<html><body>" + status + "</body></html>");
}

std::string oversized(std::size_t size) {
  return page("200 OK", kXml, "<?xml version=\"1.0\"?><netft>" + std::string(size, ' '));
}

std::string body_of(const std::string& answer) {
  const std::size_t headers = answer.find(kEndOfHeaders);
  return headers == std::string::npos ? std::string() : answer.substr(headers + kEndOfHeaders.size());
}

/// From "<tag>" to the end of its line; npos, 0 when there is none.
std::pair<std::size_t, std::size_t> place_of(const std::string& body, const std::string& tag) {
  const std::size_t begin = body.find("<" + tag + ">");
  if (begin == std::string::npos) return {begin, 0};
  return {begin, body.find('\n', begin) + 1 - begin};
}

std::string without(const std::string& answer, const std::string& tag) {
  std::string body = body_of(answer);
  const auto [begin, size] = place_of(body, tag);
  if (size > 0) body.erase(begin, size);
  return page("200 OK", kXml, body);
}

std::string with_twice(const std::string& answer, const std::string& tag) {
  std::string body = body_of(answer);
  const auto [begin, size] = place_of(body, tag);
  if (size > 0) body.insert(begin, body.substr(begin, size));
  return page("200 OK", kXml, body);
}

/// "Prüfstand" in Latin-1, in a page that says UTF-8.
std::string in_latin_1(const std::string& answer) {
  std::string body = body_of(answer);
  const auto [begin, size] = place_of(body, "cfgnam");
  if (size > 0)
    body.replace(begin, size,
                 "<cfgnam>Pr\xfc"
                 "fstand</cfgnam>\n");
  return page("200 OK", "text/xml; charset=utf-8", body);
}

std::string in_utf_16(const std::string& answer) {
  std::string body = "\xff\xfe";
  for (const char c : body_of(answer)) (body += c) += '\0';
  return page("200 OK", "text/xml; charset=utf-16", body);
}

void spoil_page(const Fault& fault, StreamReply& reply) {
  switch (fault.kind) {
    case FaultKind::http_slow:
      reply.wait = std::max(reply.wait, fault.delay);
      return;
    case FaultKind::http_truncated:
      reply.bytes.resize(std::min(reply.bytes.size(), static_cast<std::size_t>(fault.size)));
      return;
    case FaultKind::http_status:
      reply.bytes = failed(fault.code);
      return;
    case FaultKind::http_oversized:
      reply.bytes = oversized(static_cast<std::size_t>(fault.size));
      return;
    case FaultKind::http_charset:
      reply.bytes = fault.utf16 ? in_utf_16(reply.bytes) : in_latin_1(reply.bytes);
      return;
    case FaultKind::http_missing_tag:
      reply.bytes = without(reply.bytes, fault.tag);
      return;
    case FaultKind::http_duplicate_tag:
      reply.bytes = with_twice(reply.bytes, fault.tag);
      return;
    default:
      return;
  }
}

void spoil_answer(const Fault& fault, StreamReply& reply) {
  const auto size = static_cast<std::size_t>(fault.size);
  if (fault.kind == FaultKind::tcp_split) {
    reply.segment = size;
    reply.pause = fault.delay;
  } else if (fault.kind == FaultKind::tcp_merged) {
    reply.wait = std::max(reply.wait, fault.delay);
  } else {
    reply.bytes.resize(std::min(reply.bytes.size(), size));
    reply.close = true;
  }
}

}  // namespace

StreamReply FaultyWire::http(std::string_view request, Instant now) {
  StreamReply reply;
  reply.bytes = box_.http(request);
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (!on_pages(script_[i].kind) || !active(i, now)) continue;
    count_use(i, now, &WireTruth::http_spoilt);
    spoil_page(script_[i], reply);
  }
  return reply;
}

bool FaultyWire::http_refused(Instant now) const noexcept {
  if (dead_) return true;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (script_[i].kind == FaultKind::http_refused && active(i, now)) return true;
  }
  return false;
}

StreamReply FaultyWire::tcp(std::string& received, Instant now) {
  StreamReply reply;
  reply.bytes = box_.tcp(received, reply.close);
  for (std::size_t i = 0; i < script_.size() && !reply.bytes.empty(); ++i) {
    if (!on_tcp(script_[i].kind) || !active(i, now)) continue;
    count_use(i, now, &WireTruth::tcp_spoilt);
    spoil_answer(script_[i], reply);
  }
  return reply;
}

}  // namespace kphi::sim
