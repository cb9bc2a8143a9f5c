// Bounces of stiff elastic bodies. Private to the layer.
#pragma once

#include "filigree/physics/contact/contact.h"

namespace filigree {

/// Whether a material's bounces are over before they are seen, and nobody would call them its own: waves run through it
/// faster than through rubber by far, and it neither yields nor melts.
bool is_stiff(const Material& material);

/// After a substep. A stiff body that hits something swings, and leaves as its own swinging has it: at 0.8 to 0.95 of
/// its speed, whatever restitution is asked for. Once it touches nothing any more, an impulse at the place of the hit
/// makes it leave as fast as was asked. What that takes comes from its vibration, and what vibration is left is heat.
/// Not where it touched several things, or for longer than it swings a few times: there it rested.
void follow_hits(std::span<BodyState> bodies, const Contacts& contacts, double dt);

} // namespace filigree
