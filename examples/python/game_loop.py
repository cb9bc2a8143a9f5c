# %% [markdown]
# # A small game
# Crates are thrown at a target while the world runs. Each hit is told by how hard it is; a sweeper that a program moves by hand
# pushes crates off the table, and what has fallen off is removed.

# %%
import numpy

import filigree

crate = filigree.Body(filigree.make("wavy-cube", resolution=12), "stone", particles=64, size=0.12)
target = filigree.Body(filigree.make("wavy-sphere", resolution=12), "jelly", particles=400, size=0.3)

table = filigree.Obstacle.box((0, -0.05, 0), (2, 0.1, 1), friction=0.4)
sweeper = filigree.Obstacle.box((-0.3, 0.15, -0.8), (1.1, 0.25, 0.1), friction=0.2)
foot = numpy.flatnonzero(target.rest[:, 1] < target.rest[:, 1].min() + 0.05)
TABLE, SWEEPER, TARGET = 0, 1, 0
simulation = filigree.Simulation(
    [filigree.Actor(target, move=(0.6, 0.17, 0))], obstacles=[table, sweeper], pins=[filigree.Pin(TARGET, foot)]
)

# %% [markdown]
# ## The loop
# A frame is a sixtieth of a second. Everything that changes the world is said between two of them.

# %%
random = numpy.random.default_rng(1)
crates, points, hits, lost = [], 0, [], 0
for frame in range(300):
    if frame % 25 == 0 and frame < 150:  # throw one
        side = random.uniform(-0.05, 0.05)
        thrown = filigree.Actor(crate, move=(-0.4, 0.25, side), velocity=(3.5, 0.5, 0), spin=(0, 0, -4))
        crates.append(simulation.add_body(thrown))

    if frame >= 150:  # sweep: where it shall be at the end of the frame
        simulation.move_obstacle(SWEEPER, move=(0, 0, min(1.5, (frame - 149) * 0.015)))

    simulation.step()

    for event in simulation.contact_events():
        if event["kind"] == "began" and event["body"] == TARGET and event["other"] in crates and event["speed"] > 0.5:
            points += 1
            hits.append(event)
            print(
                f"frame {frame}: crate {event['other']} hits at {event['speed']:.1f} m/s, {event['impulse']:.2f} N s,"
                f" at {numpy.round(event['place'], 2)}"
            )

    for number in list(crates):
        if simulation.positions(number)[:, 1].max() < -0.5:  # it fell off the table
            simulation.remove_body(number)
            crates.remove(number)
            lost += 1

# %%
print(f"{points} hits, {lost} crates swept off, {len(crates)} left")
assert points >= 3
assert lost >= 3
assert all(hit["impulse"] > 0 for hit in hits)

# %% [markdown]
# ## Pointing at things
# What a ray meets first, as a click of the mouse would: the point on the body at rest is what a hand seizes.

# %%
hit = simulation.cast_ray((0.6, 2, 0), (0, -1, 0))
assert hit["body"] == TARGET
simulation.set_hands([filigree.Hand(TARGET, hit["rest"], hit["place"] + [0, 0.2, 0])])
simulation.step(60)
lifted = simulation.cast_ray((0.6, 2, 0), (0, -1, 0))
print(f"the target's top at {hit['place'][1]:.2f} m was lifted to {lifted['place'][1]:.2f} m")
assert lifted["place"][1] > hit["place"][1] + 0.03
