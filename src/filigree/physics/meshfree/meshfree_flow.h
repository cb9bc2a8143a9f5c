// Plastic flow, heat and melting of a meshfree body: what its particles remember. Private to the layer.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/physics/body.h"
#include "filigree/physics/meshfree/meshfree_gather.h"

#include <string>
#include <string_view>

namespace filigree::meshfree {

/// Of each particle D (see meshfree_elasticity.cpp) and its temperature. Bodies that neither yield nor melt have none.
class Flow {
public:
    explicit Flow(const Body& body);

    bool is_active() const { return !stored_.empty(); }
    const Mat3f* stored() const { return stored_.empty() ? nullptr : stored_.data(); } ///< D; null: the identity
    float melted(std::size_t i) const;                                                 ///< 0 solid .. 1 melt
    float shear_modulus(std::size_t i) const;                                          ///< Pa
    float solid_shear() const { return shear_; }
    float melt_shear() const { return melt_shear_; }

    /// Heating of the surface, and conduction between neighbours, which keeps the sum of volume times temperature.
    void move_heat(const MlsNeighbours& neighbours, float dt, const RunContext& context);
    /// Yielding and relaxation over a substep. Whether neighbourhoods have become so distorted that they should be
    /// renewed.
    bool move_matter(const MlsNeighbours& neighbours, const Float4* position, float dt, const RunContext& context);

    /// Before neighbourhoods are renewed: D takes up the gradients there are.
    void take_gradients(const MlsNeighbours& neighbours, const Float4* position, const RunContext& context);
    /// After that: what was crushed is round, and the volume of melts is set right.
    void begin_anew(const MlsNeighbours& neighbours, const RunContext& context);

    /// What is remembered.
    struct Memory {
        std::vector<Mat3f> stored, renewed; ///< D, and D at the last renewal
        std::vector<float> temperature;     ///< K
    };
    Memory memory() const { return {stored_, renewed_, temperature_}; }
    /// False where it is of another body.
    bool remember(Memory memory);

private:
    float shear_modulus_of(float melted_part) const { return shear_ + melted_part * (melt_shear_ - shear_); }
    float flow_particle(const MlsNeighbours& neighbours, const Float4* position, std::size_t i, float dt);
    void correct_volume(const MlsNeighbours& neighbours, const RunContext& context);

    const Body& body_;
    float shear_, melt_shear_; // Pa
    std::vector<Mat3f> stored_, renewed_;
    std::vector<float> temperature_;
};

} // namespace filigree::meshfree
