#include "filigree/pack/symbols.h"

#include <array>
#include <bit>

namespace filigree {

namespace {

// Numbers as symbols: 0 to 15 themselves, then two a power of two with the other bits behind; the last one for the
// rest.
constexpr unsigned kDirect = 16, kWholeNumber = SymbolModel::kSymbols - 1;
constexpr unsigned kLargestExponent = 26;
constexpr std::uint32_t kLowestState = 1u << 16; // states are this to 2^32 - 1
static_assert(kDirect + (kLargestExponent - 4) * 2 + 1 < kWholeNumber);

void put_u32(std::string& bytes, std::uint32_t value) {
    for (unsigned k = 0; k < 4; ++k) bytes.push_back(char(value >> (8 * k)));
}

} // namespace

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

void SymbolWriter::number_with_sign(unsigned context, std::int32_t value) { number(context, flg_without_sign(value)); }

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
    size_ = stream.size();
    flg_symbols_begin(&in_, stream.data(), stream.size());
}

} // namespace filigree
