#include "filigree/pack/symbols.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace filigree {

namespace {

// Numbers as symbols: 0 to 15 themselves, then two a power of two with the other bits behind; the last one for the
// rest.
constexpr unsigned kDirect = 16, kWholeNumber = SymbolModel::kSymbols - 1;
constexpr unsigned kLargestExponent = 26;
static_assert(kDirect + (kLargestExponent - 4) * 2 + 1 < kWholeNumber);

constexpr std::array<NumberSymbol, SymbolModel::kSymbols> number_symbols() {
    std::array<NumberSymbol, SymbolModel::kSymbols> symbols{};
    for (unsigned s = 0; s < kDirect; ++s) symbols[s] = {s, 0};
    for (unsigned s = kDirect; s < kWholeNumber; ++s) { // there are none above the largest exponent: damage
        const unsigned exponent = std::min((s - kDirect) / 2 + 4, kLargestExponent);
        symbols[s] = {(2 + (s - kDirect) % 2) << (exponent - 1), exponent - 1};
    }
    symbols[kWholeNumber] = {0, 32};
    return symbols;
}

std::uint32_t without_sign(std::int32_t value) { return (std::uint32_t(value) << 1) ^ (value < 0 ? 0xffffffffu : 0u); }

void put_u32(std::string& bytes, std::uint32_t value) {
    for (unsigned k = 0; k < 4; ++k) bytes.push_back(char(value >> (8 * k)));
}
std::uint32_t get_u32(std::string_view bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (unsigned k = 0; k < 4; ++k) value |= std::uint32_t(std::uint8_t(bytes[at + k])) << (8 * k);
    return value;
}

} // namespace

constinit const std::array<NumberSymbol, SymbolModel::kSymbols> kNumberSymbols = number_symbols();

SymbolModel::SymbolModel() {
    for (unsigned s = 0; s < kSymbols; ++s) counts_[s] = 1 + (24u >> (s / 6));
    starts_[kSymbols] = kShares;
    update();
    pause_ = until_update_ = 4;
}

void SymbolModel::update() {
    std::uint32_t total = 0;
    for (const std::uint32_t count : counts_) total += count;
    // One share for each, the others by their counts, rounded down: the half keeps what comes out whole from the
    // rounding of the quotient.
    const double one = 1.0 / total;
    std::uint64_t before = 0;
    for (unsigned s = 0; s < kSymbols; ++s) {
        starts_[s] = std::uint16_t(s + std::uint32_t((double(before * (kShares - kSymbols)) + 0.5) * one));
        before += counts_[s];
    }
    unsigned cell = 0;
    for (unsigned s = 0; s < kSymbols; ++s)
        for (const unsigned end = unsigned(starts_[s + 1] + (1 << kCoarse) - 1) >> kCoarse; cell < end; ++cell)
            first_[cell] = std::uint8_t(s);
    constexpr std::uint64_t kMostCounts = std::uint64_t{kStep} << 15; // what came long ago counts less
    if (total > kMostCounts)
        for (std::uint32_t& count : counts_) count = count / 2 + 1;
    pause_ = std::min(2 * pause_, kLongestPause);
    until_update_ = pause_;
}

void SymbolWriter::symbol(unsigned context, unsigned symbol) {
    SymbolModel& model = models_[context];
    coded_.push_back({std::uint16_t(model.start(symbol)), std::uint16_t(model.share(symbol))});
    model.count(symbol);
}

void SymbolWriter::bits(std::uint32_t value, unsigned count) {
    pending_ |= (std::uint64_t{value} & ((std::uint64_t{1} << count) - 1)) << pending_count_;
    pending_count_ += count;
    for (; pending_count_ >= 8; pending_count_ -= 8, pending_ >>= 8) bits_.push_back(char(pending_));
}

void SymbolWriter::number(unsigned context, std::uint32_t value) {
    if (value < kDirect) return symbol(context, value);
    const unsigned exponent = unsigned(std::bit_width(value)) - 1;
    if (exponent > kLargestExponent) {
        symbol(context, kWholeNumber);
        return bits(value, 32);
    }
    symbol(context, kDirect + (exponent - 4) * 2 + (value >> (exponent - 1) & 1));
    bits(value, exponent - 1);
}

void SymbolWriter::number_with_sign(unsigned context, std::int32_t value) { number(context, without_sign(value)); }

std::string SymbolWriter::finish() {
    if (pending_count_ > 0) bits_.push_back(char(pending_));
    // Backwards, as the reader takes out last what went in last. Words come out in the order in which it wants them.
    std::array<std::uint32_t, 4> states;
    states.fill(kLowestState);
    std::vector<std::uint16_t> words;
    for (std::size_t i = coded_.size(); i-- > 0;) {
        std::uint32_t& state = states[i % 4];
        const auto [start, share] = coded_[i];
        if (state >= std::uint64_t{share} << (32 - SymbolModel::kShareBits)) {
            words.push_back(std::uint16_t(state));
            state >>= 16;
        }
        state = (state / share << SymbolModel::kShareBits) + start + state % share;
    }
    std::string stream;
    put_u32(stream, std::uint32_t(words.size()));
    for (const std::uint32_t state : states) put_u32(stream, state);
    for (std::size_t i = words.size(); i-- > 0;) {
        stream.push_back(char(words[i]));
        stream.push_back(char(words[i] >> 8));
    }
    stream += bits_;
    coded_.clear();
    bits_.clear();
    pending_ = pending_count_ = 0;
    return stream;
}

SymbolReader::SymbolReader(std::string_view stream, unsigned contexts) : models_(contexts) { read_next(stream); }

void SymbolReader::read_next(std::string_view stream) {
    turn_ = 0;
    pending_ = pending_count_ = 0;
    is_damaged_ = false;
    size_ = stream.size();
    word_ = words_end_ = bit_ = bits_end_ = nullptr;
    constexpr std::size_t kHead = 20;
    if (stream.size() < kHead || get_u32(stream, 0) > (stream.size() - kHead) / 2) {
        is_damaged_ = true;
        states_.fill(kLowestState);
        return;
    }
    const std::size_t words = get_u32(stream, 0);
    for (std::size_t k = 0; k < 4; ++k) states_[k] = get_u32(stream, 4 + 4 * k);
    word_ = stream.data() + kHead;
    words_end_ = bit_ = word_ + 2 * words;
    bits_end_ = stream.data() + stream.size();
}

/// Byte by byte, where fewer than eight are left.
void SymbolReader::fetch_last_bits(unsigned count) {
    while (pending_count_ < count) {
        if (bit_ == bits_end_) {
            is_damaged_ = true;
            pending_count_ += 32;
            return;
        }
        pending_ |= std::uint64_t(std::uint8_t(*bit_++)) << pending_count_;
        pending_count_ += 8;
    }
}

} // namespace filigree
