#include "filigree/coding/symbols.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace filigree {

namespace {

constexpr std::uint32_t kLowestState = 1u << 16; // states are kLowestState to 2^32 - 1, words of 16 bits go in and out

// Numbers as symbols: 0 to 15 themselves, then two a power of two with the other bits behind; the last one for the
// rest.
constexpr unsigned kDirect = 16, kWholeNumber = SymbolModel::kSymbols - 1;
constexpr unsigned kLargestExponent = 26;
static_assert(kDirect + (kLargestExponent - 4) * 2 + 1 < kWholeNumber);

std::uint32_t without_sign(std::int32_t value) { return (std::uint32_t(value) << 1) ^ (value < 0 ? 0xffffffffu : 0u); }
std::int32_t with_sign(std::uint32_t value) { return std::int32_t(value >> 1) ^ -std::int32_t(value & 1); }

void put_u32(std::string& bytes, std::uint32_t value) {
    for (unsigned k = 0; k < 4; ++k) bytes.push_back(char(value >> (8 * k)));
}
std::uint32_t get_u32(std::string_view bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (unsigned k = 0; k < 4; ++k) value |= std::uint32_t(std::uint8_t(bytes[at + k])) << (8 * k);
    return value;
}

} // namespace

SymbolModel::SymbolModel() {
    for (unsigned s = 0; s < kSymbols; ++s) counts_[s] = 1 + (24u >> (s / 6));
    update();
    pause_ = until_update_ = 4;
}

void SymbolModel::update() {
    std::uint64_t total = 0;
    for (const std::uint32_t count : counts_) total += count;
    // One share for each, the others by their counts.
    std::uint64_t before = 0;
    for (unsigned s = 0; s < kSymbols; ++s) {
        starts_[s] = std::uint16_t(s + before * (kShares - kSymbols) / total);
        before += counts_[s];
    }
    starts_[kSymbols] = std::uint16_t(kShares);
    unsigned symbol = 0;
    for (unsigned k = 0; k < first_.size(); ++k) {
        while (starts_[symbol + 1] <= k << kCoarse) ++symbol;
        first_[k] = std::uint8_t(symbol);
    }
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
    words_ = bits_ = {};
    constexpr std::size_t kHead = 20;
    if (stream.size() < kHead || get_u32(stream, 0) > (stream.size() - kHead) / 2) {
        is_damaged_ = true;
        states_.fill(kLowestState);
        return;
    }
    const std::size_t words = get_u32(stream, 0);
    for (std::size_t k = 0; k < 4; ++k) states_[k] = get_u32(stream, 4 + 4 * k);
    words_ = stream.substr(kHead, 2 * words);
    bits_ = stream.substr(kHead + 2 * words);
}

unsigned SymbolReader::symbol(unsigned context) {
    SymbolModel& model = models_[context];
    std::uint32_t& state = states_[turn_++ % 4];
    const std::uint32_t place = state & (SymbolModel::kShares - 1);
    const unsigned symbol = model.at(place);
    state = model.share(symbol) * (state >> SymbolModel::kShareBits) + place - model.start(symbol);
    if (state < kLowestState) {
        std::uint32_t word = 0;
        if (words_.size() >= 2) {
            word = std::uint8_t(words_[0]) | std::uint32_t(std::uint8_t(words_[1])) << 8;
            words_.remove_prefix(2);
        } else
            is_damaged_ = true;
        state = state << 16 | word;
    }
    model.count(symbol);
    return symbol;
}

std::uint32_t SymbolReader::bits(unsigned count) {
    while (pending_count_ < count) {
        if (bits_.empty()) {
            is_damaged_ = true;
            pending_count_ += 32;
            break;
        }
        pending_ |= std::uint64_t(std::uint8_t(bits_[0])) << pending_count_;
        bits_.remove_prefix(1);
        pending_count_ += 8;
    }
    const auto value = std::uint32_t(pending_ & ((std::uint64_t{1} << count) - 1));
    pending_ >>= count;
    pending_count_ -= count;
    return value;
}

std::uint32_t SymbolReader::number(unsigned context) {
    const unsigned symbol = this->symbol(context);
    if (symbol < kDirect) return symbol;
    if (symbol == kWholeNumber) return bits(32);
    const unsigned exponent = std::min((symbol - kDirect) / 2 + 4, kLargestExponent);
    const std::uint32_t high = 2 + (symbol - kDirect) % 2;
    return high << (exponent - 1) | bits(exponent - 1);
}

std::int32_t SymbolReader::number_with_sign(unsigned context) { return with_sign(number(context)); }

} // namespace filigree
