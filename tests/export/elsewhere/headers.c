/* The plugin by MuJoCo's own headers: headers LIBRARY MODEL STEPS prints the ankle's angle. */
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>

int main(int count, char **words) {
  char error[400] = "";
  if (count != 4) return 2;
  mj_loadPluginLibrary(words[1]);
  mjModel *model = mj_loadXML(words[2], NULL, error, sizeof error);
  if (!model) return fprintf(stderr, "%s\n", error), 1;
  mjData *data = mj_makeData(model), *copy = mj_copyData(NULL, model, data);
  mj_resetDataKeyframe(model, data, 0);
  mj_deleteData(copy);
  for (int k = atoi(words[3]); k > 0; k--) mj_step(model, data);
  printf("%.17g\n", data->qpos[0]);
  mj_deleteData(data);
  mj_deleteModel(model);
  return mjcb_act_bias || mjcb_act_dyn;
}
