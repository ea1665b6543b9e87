#include distance.glsl

float DE(vec3 pos) { return formula_distance(pos); }

// DE-Raytracer's own takes differences of DE, which is only a bound.
vec3 normal(vec3 pos, float normalDistance) {
  return formula_normal(pos, max(normalDistance, 2.0 * FinestStep));
}

#preset Default
FOV = 0.27
Eye = 2.7,1.45,4.68
Target = 0,0,0
Up = 0,1,0
Detail = -3.5
DetailAO = -1.4
FudgeFactor = 1
MaxRaySteps = 600
Dither = 0
NormalBackStep = 0
AO = 0,0,0,0.6
Specular = 0.1
SpotLight = 1,0.96,0.9,0.7
SpotLightDir = 0.35,0.4
CamLight = 1,1,1,0.6
HardShadow = 0
BaseColor = 0.84,0.66,0.5
OrbitStrength = 0
#endpreset
