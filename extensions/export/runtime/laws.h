/* The laws of bodies that flow, by Flowing.rule. */
#ifndef HYCO_EXPORTED_LAWS
#define HYCO_EXPORTED_LAWS

static const HycoFlowRule *const rule_of[] = {&HycoFlowJ2, &HycoFlowNorton, &HycoFlowStrainHardening,
                                              &HycoFlowLimbackAndersson};

#endif
