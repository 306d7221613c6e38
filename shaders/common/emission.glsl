// What every integrator of emission and absorption shares: when a ray may end, and where its depth is.

#ifndef TERMINATION
#define TERMINATION 0   // 1: a ray ends when its opacity reaches `termination`
#endif

uniform float depth_opacity;        // depth is where this much is hidden
#if TERMINATION
uniform float termination;
#define ENOUGH termination
#else
#define ENOUGH 1.0      // nothing can be added to a ray that is hidden wholly
#endif
