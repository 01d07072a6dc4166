// BLAKE2s, keyed (RFC 7693): written from its text for this library; public domain (CC0). Little-endian machines.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace kendama {
using Bytes = std::vector<uint8_t>;

inline Bytes blake2s(const Bytes& key, const Bytes& data, size_t size) {
  static const uint32_t iv[8] = {0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19};
  static const uint8_t sigma[10][17] = {
      "\0\1\2\3\4\5\6\7\10\11\12\13\14\15\16\17", "\16\12\4\10\11\17\15\6\1\14\0\2\13\7\5\3", "\13\10\14\0\5\2\17\15\12\16\3\6\7\1\11\4",
      "\7\11\3\1\15\14\13\16\2\6\5\12\4\0\17\10", "\11\0\5\7\2\4\12\17\16\1\13\14\6\10\3\15", "\2\14\6\12\0\13\10\3\4\15\7\5\17\16\1\11",
      "\14\5\1\17\16\15\4\12\0\7\6\3\11\2\10\13", "\15\13\7\16\14\1\3\11\5\0\17\4\10\6\2\12", "\6\17\16\11\13\3\0\10\14\2\15\7\1\4\12\5",
      "\12\2\10\4\7\6\1\5\17\13\11\16\3\14\15\0"};
  uint32_t h[8];
  for (int i = 0; i < 8; ++i) h[i] = iv[i];
  h[0] ^= 0x01010000u ^ uint32_t(key.size() << 8) ^ uint32_t(size);
  Bytes all(key.empty() ? 0 : 64, 0);
  std::copy(key.begin(), key.end(), all.begin());
  all.insert(all.end(), data.begin(), data.end());
  const uint64_t length = all.size();
  all.resize(length == 0 ? 64 : (length + 63) / 64 * 64, 0);
  auto rotated = [](uint32_t x, int n) { return (x >> n) | (x << (32 - n)); };
  for (uint64_t at = 0; at < all.size(); at += 64) {
    uint32_t m[16], v[16];
    std::memcpy(m, &all[at], 64);
    for (int i = 0; i < 8; ++i) v[i] = h[i], v[i + 8] = iv[i];
    const bool last = at + 64 == all.size();
    const uint64_t counted = last ? length : at + 64;
    v[12] ^= uint32_t(counted), v[13] ^= uint32_t(counted >> 32), v[14] ^= last ? 0xFFFFFFFFu : 0;
    for (const auto& s : sigma)
      for (int i = 0; i < 8; ++i) {
        const int a = i % 4, r = i / 4, b = 4 + (i + r) % 4, c = 8 + (i + 2 * r) % 4, d = 12 + (i + 3 * r) % 4;
        v[a] += v[b] + m[s[2 * i]], v[d] = rotated(v[d] ^ v[a], 16), v[c] += v[d], v[b] = rotated(v[b] ^ v[c], 12);
        v[a] += v[b] + m[s[2 * i + 1]], v[d] = rotated(v[d] ^ v[a], 8), v[c] += v[d], v[b] = rotated(v[b] ^ v[c], 7);
      }
    for (int i = 0; i < 8; ++i) h[i] ^= v[i] ^ v[i + 8];
  }
  const auto* out = reinterpret_cast<const uint8_t*>(h);
  return Bytes(out, out + size);
}
}  // namespace kendama
